// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <stdexcept>
#include <utility>

#include <opencv2/core/utility.hpp>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/record_run.hpp"
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

Evaluation evaluate_found(const MatchList& matches, const FinishedRun* run,
                          const std::optional<GroundTruth>& known, const ScoringRequest& request) {
  const FramesRead frames = run ? run->frames() : FramesRead{.times_s = matches.times_s};
  const bool is_recorded = run && !known;
  const auto [truth, evaluation] =
      request.resolve(frames, is_recorded ? run->scoring() : Scoring{known, {}});
  if (truth) return evaluate(matches, *truth, evaluation);
  throw Error(ErrorKind::option, "There is no ground truth; give truth.");
}

Positions to_positions(const PositionRows& rows_m) {
  if (rows_m.ndim() != 2 || rows_m.shape(1) != 3) {
    throw py::value_error(fmt::format("positions_m has shape {}, but must be (n, 3).",
                                      literal(rows_m.attr("shape"))));
  }
  Positions positions_m(static_cast<std::size_t>(rows_m.shape(0)));
  for (py::ssize_t row = 0; row < rows_m.shape(0); ++row) {
    const cv::Vec3d position(rows_m.at(row, 0), rows_m.at(row, 1), rows_m.at(row, 2));
    const double length = cv::norm(position);
    if (std::isinf(length)) {
      throw py::value_error("positions_m is infinite somewhere, but must be nan if unknown.");
    }
    if (!std::isnan(length)) positions_m[static_cast<std::size_t>(row)] = position;
  }
  return positions_m;
}

/// A Python exception of a callback, which ends a run. what() is for run.json.
struct RaisedInCallback : std::runtime_error {
  RaisedInCallback(const std::string& text, std::exception_ptr raised)
      : std::runtime_error(text), exception(std::move(raised)) {}
  std::exception_ptr exception;
};

/// "interrupt" for Ctrl-C; bytes of file names that are not valid text are escaped.
std::string reason_of(const py::error_already_set& raised) {
  if (raised.matches(PyExc_KeyboardInterrupt)) return "interrupt";
  return py::bytes(py::str(raised.value()).attr("encode")("utf-8", "backslashreplace"));
}

template <typename Call>
void call_python(const Call& call) {
  try {
    call();
  } catch (const py::error_already_set& raised) {
    const WithGil acquire;
    throw RaisedInCallback(reason_of(raised), std::current_exception());
  }
}

/// For run_folder() of the package, which has keywords of the same names.
FinishedRun run_folder(SharedSource& source, const RunRequest& request,
                       const OnBadFrame& on_bad_frame) {
  const RunListener listener{
      .on_detection = [](const Detection& /*detection*/) { call_python([] { check_signals(); }); },
      .on_bad_frame =
          [&](const std::string& sentence) {
            call_python([&] { tell(on_bad_frame, Text{sentence}); });
          }};
  const std::atomic<bool> never{false};
  const WithoutGil release;
  try {
    const RunOutcome outcome = record_run(source, request, listener, never);
    tell_early_end(source, on_bad_frame);
    if (outcome.fault) throw Error(*outcome.fault);
    return read_run(outcome.folder);
  } catch (const RaisedInCallback& raised) {
    std::rethrow_exception(raised.exception);
  }
}

RunRequest request_of(const LoopDetectorOptions& options, const Path& folder, bool overwrite,
                      bool evidence, const Path& map, bool keep_images,
                      std::optional<std::size_t> map_cache_mb, const ScoringRequest& scoring,
                      const std::optional<GroundTruth>& truth, const Path& poses,
                      const std::optional<PositionRows>& positions_m, const Path& mask,
                      const Path& camera, const Path& depth, double depth_scale,
                      const Path& odometry, bool correct, const Path& right, double baseline_m) {
  const std::string camera_file = camera.string();
  return {.options = options,
          .threads = std::max(1, cv::getNumThreads()),
          .folder = folder.string(),
          .overwrite = overwrite,
          .evidence = evidence,
          .map = map.string(),
          .keep_images = keep_images,
          .map_cache_mb = map_cache_mb.value_or(kMapCache_mb),
          .scoring = scoring,
          .truth = truth,
          .poses = poses.string(),
          .positions_m = positions_m ? std::optional(to_positions(*positions_m)) : std::nullopt,
          .mask = mask.string(),
          .camera = camera_file.empty() ? std::nullopt : std::optional(read_camera(camera_file)),
          .camera_file = camera_file,
          .depth = depth.string(),
          .depth_scale = depth_scale,
          .odometry = odometry.string(),
          .correct = correct,
          .right = right.string(),
          .baseline_m = baseline_m};
}

void bind_run_folder(py::module_& module) {
  py::class_<RunRequest>(module, "_RunRequest")
      .def(py::init(&request_of), py::kw_only(), py::arg("options"), py::arg("folder"),
           py::arg("overwrite"), py::arg("evidence"), py::arg("map"), py::arg("keep_images"),
           whole("map_cache_mb"), py::arg("scoring"), py::arg("truth"), py::arg("poses"),
           py::arg("positions_m"), py::arg("mask"), py::arg("camera"), py::arg("depth"),
           py::arg("depth_scale"), py::arg("odometry"), py::arg("correct"), py::arg("right"),
           py::arg("baseline_m"));
  module.def("_run_folder", &run_folder, py::arg("source"), py::arg("request"),
             py::arg("on_bad_frame"));
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
  module.def("image_pairs", &image_pairs, py::arg("detections"), Free(),
             "The loops within this session as lines 'NAME MATCH_NAME', for hloc and COLMAP.");
  module.def("_run", &run_source, py::arg("source"), py::arg("detector"), py::arg("on_detection"),
             py::arg("on_bad_frame"));
  bind_run_folder(module);
  module.def("_evaluate", &evaluate_found, py::arg("matches"), py::arg("run"), py::arg("known"),
             py::arg("scoring"), Free());
}

}  // namespace loopbit::python
