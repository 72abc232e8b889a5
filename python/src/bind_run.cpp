// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/error.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/recorded_run.hpp"
#include "loopbit/runner.hpp"

#include "bind_data.hpp"
#include "bind_detector.hpp"
#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"
#include "text.hpp"

namespace loopbit::python {
namespace {

/// A Python callback with one argument, or None.
template <typename Told>
class Callback : public pybind11::object {
 public:
  static bool accept(PyObject* object) {
    return object != nullptr && (object == Py_None || PyCallable_Check(object) != 0);
  }
  PYBIND11_OBJECT_DEFAULT(Callback, pybind11::object, accept)
};

}  // namespace
}  // namespace loopbit::python

namespace pybind11::detail {

template <typename Told>
struct handle_type_name<loopbit::python::Callback<Told>> {
  // NOLINTNEXTLINE: pybind11's name
  static constexpr auto name =
      const_name("Callable[[") + make_caster<Told>::name + const_name("], None]");
};

}  // namespace pybind11::detail

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Path = std::filesystem::path;
using OnDetection = Callback<Detection>;
using OnBadFrame = Callback<Text>;
using PositionRows = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Free = py::call_guard<WithoutGil>;

/// The callbacks between two frames.
template <typename Told>
void tell(const Callback<Told>& callback, const Told& told) {
  const WithGil acquire;
  check_signals();
  if (callback.is_none()) return;
  const py::tuple arguments = py::make_tuple(told);
  const auto result = py::reinterpret_steal<py::object>(
      unless_ended([&] { return PyObject_CallObject(callback.ptr(), arguments.ptr()); }));
  if (!result) throw py::error_already_set();
}

/// Told like a bad frame, and last.
void tell_early_end(const ImageSource& source, const OnBadFrame& on_bad_frame) {
  const std::string why = source.early_end();
  if (!why.empty()) tell(on_bad_frame, Text{why});
}

std::vector<Detection> run_source(SharedSource& source, SharedDetector& detector,
                                  const OnDetection& on_detection, const OnBadFrame& on_bad_frame) {
  std::vector<Detection> detections;
  const RunListener listener{
      .on_detection =
          [&](const Detection& detection) {
            detections.push_back(detection);
            tell(on_detection, detection);
          },
      .on_bad_frame = [&](const std::string& sentence) { tell(on_bad_frame, Text{sentence}); }};
  const std::atomic<bool> never{false};
  {
    const WithoutGil release;
    detector.exclusively([&](LoopDetector& free) { run(source, free, listener, never); });
    tell_early_end(source, on_bad_frame);
  }
  return detections;
}

RunRecord record_of(const SharedSource& source, const LoopDetectorOptions& options,
                    const std::string& map, const std::string& truth) {
  return {.input = source.input(),
          .description = source.description(),
          .options = options,
          .every = source.every(),
          .limit = source.limit(),
          .map_path = map,
          .truth = truth};
}

std::unique_ptr<RecordedRun> record_run(SharedSource& source, const Path& out,
                                        const LoopDetectorOptions& options, const Path& map,
                                        bool overwrite, bool keep_images,
                                        std::optional<std::size_t> map_cache_mb,
                                        const ScoringRequest& scoring, const Path& poses) {
  if (overwrite || options.exclusion.seconds > 0) source.prove(options);
  return std::make_unique<RecordedRun>(
      record_of(source, options, map.string(), scoring.truth),
      RunOutput{.folder = out.string(),
                .overwrite = overwrite,
                .keep_images = keep_images,
                .map_cache_mb = map_cache_mb.value_or(kMapCache_mb),
                .inputs = {source.input(), scoring.truth, scoring.not_false, scoring.ignore,
                           poses.string()}});
}

/// Scores by the request, or by `known` truth. `frames`: see SharedSource::frames_left().
void score(RecordedRun& recorded, const ScoringRequest& request,
           const std::optional<GroundTruth>& known, std::optional<std::size_t> frames) {
  const RunRecord& record = recorded.record();
  FrameTimes times_s = match_list(recorded.folder().detections()).times_s;
  const bool all = record.limit == 0 && frames == times_s.size();
  const auto [truth, evaluation] =
      request.resolve({record.every, record.views, std::move(times_s), all}, {known, {}});
  if (truth) recorded.score(*truth, evaluation);
}

Evaluation evaluate_found(const MatchList& matches, const FinishedRun* run,
                          const std::optional<GroundTruth>& known, const ScoringRequest& request) {
  const FramesRead frames = run ? frames_read(*run) : FramesRead{.times_s = matches.times_s};
  const bool is_recorded = run && !known;
  const auto [truth, evaluation] =
      request.resolve(frames, is_recorded ? recorded_scoring(*run) : Scoring{known, {}});
  if (truth) return evaluate(matches, *truth, evaluation);
  throw Error(ErrorKind::option, "There is no ground truth; give truth.");
}

void detect(RecordedRun& recorded, SharedSource& source, const OnBadFrame& on_bad_frame,
            bool keep_evidence) {
  const RunListener listener{
      .on_detection = [](const Detection& /*detection*/) { check_signals(); },
      .on_bad_frame = [&](const std::string& sentence) { tell(on_bad_frame, Text{sentence}); }};
  const std::atomic<bool> never{false};
  const WithoutGil release;
  recorded.detect(source, listener, keep_evidence, never);
  tell_early_end(source, on_bad_frame);
}

void keep_positions(RecordedRun& recorded, const PositionRows& positions_m) {
  std::vector<std::optional<cv::Vec3d>> rows(static_cast<std::size_t>(positions_m.shape(0)));
  for (py::ssize_t row = 0; row < positions_m.shape(0); ++row) {
    const cv::Vec3d position(positions_m.at(row, 0), positions_m.at(row, 1),
                             positions_m.at(row, 2));
    if (!std::isnan(cv::norm(position))) rows[static_cast<std::size_t>(row)] = position;
  }
  const WithoutGil release;
  recorded.keep_positions(rows);
}

/// For run_folder() of the package, which uses RecordedRun like the command.
void bind_recorded_run(py::module_& module) {
  py::class_<RecordedRun>(module, "_RecordedRun")
      .def(py::init(&record_run), py::arg("source"), py::arg("out"), py::arg("options"),
           py::arg("map"), py::arg("overwrite"), py::arg("keep_images"), whole("map_cache_mb"),
           py::arg("scoring"), py::arg("poses"), Free())
      .def("detect", &detect, py::arg("source"), py::arg("on_bad_frame"), py::arg("evidence"))
      .def_property_readonly("path",
                             [](const RecordedRun& self) { return Text{self.folder().path()}; })
      .def_property_readonly(
          "times_s",
          [](const RecordedRun& self) { return match_list(self.folder().detections()).times_s; })
      .def("score", &score, py::arg("scoring"), py::arg("known"), whole("frames"), Free())
      .def("keep_positions", &keep_positions, py::arg("positions_m"))
      .def("finish", &RecordedRun::finish, py::arg("stopped_by"), Free());
}

std::map<PlaceId, BinaryContent> contents_of(const FinishedRun& run) {
  std::map<PlaceId, BinaryContent> contents;
  if (run.evidence_path.empty()) return contents;
  EvidenceReader(run.evidence_path)
      .for_each_content([&](PlaceId frame, const BinaryContent& content) {
        contents.emplace_hint(contents.end(), frame, content);
      });
  return contents;
}

void bind_finished_run(py::module_& module) {
  py::class_<FinishedRun>(module, "FinishedRun", "The folder of a run.")
      .def_property_readonly("path", text_of(&FinishedRun::path))
      .def_readonly("detections", &FinishedRun::detections, "One Detection per frame.")
      .def_readonly("truth", &FinishedRun::truth,
                    "The ground truth that the run was given, or None.")
      .def_readonly(
          "record_json", &FinishedRun::record_json,
          "The text of run.json, or empty. Its stopped_by is 'running' until the run ends.")
      .def_property_readonly(
          "positions_m", [](const FinishedRun& self) { return to_array(self.positions_m); },
          "Camera centres, shape (n, 3), nan if unknown; n is 0 if the run had no poses.")
      .def("contents", &contents_of, Free(),
           "The binary content of each readable frame, by frame number; empty without evidence.")
      .def("__repr__", [](const FinishedRun& self) {
        return Text{fmt::format("FinishedRun('{}', {} frames)", self.path, self.detections.size())};
      });
  module.def(
      "read_run", [](const Path& path) { return read_run(path.string()); }, py::arg("path"), Free(),
      "Reads a run folder, also of an interrupted run.");
}

}  // namespace

void bind_run(py::module_& module) {
  bind_finished_run(module);
  module.def("match_list", &match_list, py::arg("detections"), Free(),
             "Converts detections to a MatchList.");
  module.def("_run", &run_source, py::arg("source"), py::arg("detector"), py::arg("on_detection"),
             py::arg("on_bad_frame"));
  bind_recorded_run(module);
  module.def("_evaluate", &evaluate_found, py::arg("matches"), py::arg("run"), py::arg("known"),
             py::arg("scoring"), Free());
}

}  // namespace loopbit::python
