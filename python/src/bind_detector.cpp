// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "bind_detector.hpp"

#include <string>
#include <string_view>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

/// Takes the lock of a detector while the GIL is free.
struct FreeAndLocked {
  explicit FreeAndLocked(std::mutex& mutex) : lock(mutex) {}

  py::gil_scoped_release release;
  std::scoped_lock<std::mutex> lock;
};

std::string class_name(std::string_view section) {
  std::string name;
  bool upper = true;
  for (const char c : section) {
    if (c != '_') name += upper ? static_cast<char>(c - 'a' + 'A') : c;
    upper = c == '_';
  }
  return name + "Options";
}

/// The part of `options` called `name`, as a reference into it, or null.
py::object section_of(const py::object& options, std::string_view name) {
  py::object found;
  for_each_section(options.cast<LoopDetectorOptions&>(), [&](std::string_view section, auto& part) {
    if (section == name)
      found = py::cast(&part, py::return_value_policy::reference_internal, options);
  });
  return found;
}

void set_section(LoopDetectorOptions& options, std::string_view name, const py::handle& value) {
  bool found = false;
  for_each_section(options, [&](std::string_view section, auto& part) {
    if (section != name) return;
    using Part = std::remove_cvref_t<decltype(part)>;
    if (!py::isinstance<Part>(value)) {
      throw py::type_error(
          fmt::format("{} is {}, but must be {}.", name, literal(value), class_name(name)));
    }
    part = value.cast<const Part&>();
    found = true;
  });
  if (!found) throw py::type_error(fmt::format("There is no section '{}' of settings.", name));
}

void bind_sections(py::class_<LoopDetectorOptions>& type) {
  py::options no_signatures;
  no_signatures.disable_function_signatures();
  std::string signature = "__init__(self, *";
  LoopDetectorOptions defaults;
  for_each_section(defaults, [&](const char* name, const auto&) {
    signature += fmt::format(", {}: {} = ...", name, class_name(name));
    const std::string doc = fmt::format("{}: changing it changes these options", class_name(name));
    type.def_property(
        name, [name](const py::object& self) { return section_of(self, name); },
        [name](LoopDetectorOptions& self, const py::object& value) {
          set_section(self, name, value);
        },
        doc.c_str());
  });
  type.def(py::init([](const py::kwargs& sections) {
             LoopDetectorOptions options;
             for (const auto& [name, value] : sections) {
               set_section(options, std::string(py::str(name)), value);
             }
             return options;
           }),
           (signature + ") -> None").c_str());
}

void bind_options(py::module_& module) {
  bind_settings<ExclusionOptions>(module, "ExclusionOptions", "exclusion",
                                  "Which of the latest frames are too recent to be candidates.");
  bind_settings<DecisionOptions>(module, "DecisionOptions", "decision",
                                 "The one rule that accepts a match: score >= min_score.");
  py::class_<LoopDetectorOptions> type(
      module, "LoopDetectorOptions",
      "Every setting of a LoopDetector, by sections. The defaults are meant for all data.");
  bind_sections(type);
  type.def("__repr__", [](const py::object& self) {
    std::string text;
    for_each_section(self.cast<LoopDetectorOptions&>(), [&](const char* name, const auto&) {
      text += fmt::format("{}{}={}", text.empty() ? "" : ",\n    ", name,
                          literal(section_of(self, name)));
    });
    return fmt::format("LoopDetectorOptions({})", text);
  });
  type.def(py::pickle([](const LoopDetectorOptions& self) { return py::str(to_json(self)); },
                      [](const py::str& json) { return options_from_json(json, "a pickle"); }));
  module.def(
      "to_json", [](const LoopDetectorOptions& options) { return to_json(options); },
      py::arg("options"), "The settings as a settings file for load_options() or --config.");
  module.def("options_from_json", &options_from_json, py::arg("json"), py::arg("source") = "json",
             "The defaults changed by what the JSON text names; source is named in errors.");
  module.def(
      "load_options", [](const std::filesystem::path& path) { return load_options(path.string()); },
      py::arg("path"), "options_from_json() of a file.");
  module.def(
      "set_option",
      [](LoopDetectorOptions& options, const std::string& name, const py::object& value) {
        const std::string text = py::isinstance<py::bool_>(value)
                                     ? (value.cast<bool>() ? "true" : "false")
                                     : std::string(py::str(value));
        set_option(options, name, text);
      },
      py::arg("options"), py::arg("name"), py::arg("value"),
      "Sets one setting by its full name, such as set_option(options, 'surf.max_keypoints', 500).");
  module.def(
      "validate", [](const LoopDetectorOptions& options) { validate(options); }, py::arg("options"),
      "Raises OptionError where settings contradict each other.");
}

std::string detection_text(const Detection& d) {
  std::string text = fmt::format("Detection(frame={}, status={}", d.frame, to_string(d.status));
  if (d.match) text += fmt::format(", match={}, score={:.1f}", *d.match, d.score);
  if (d.match) text += fmt::format(", similarity={:.3f}, inliers={}", d.similarity, d.inliers);
  return text + ")";
}

void bind_detection(py::module_& module) {
  py::enum_<Status> status(module, "Status", "Why a frame is a loop, or why not.");
  for (const Status each : kAllStatuses) status.value(to_string(each).data(), each);
  py::class_<StepTimes>(module, "StepTimes", "Wall time of the steps of one detection.")
      .def_readonly("content_ms", &StepTimes::content_ms,
                    "Binary content, with conversion to grey.")
      .def_readonly("retrieval_ms", &StepTimes::retrieval_ms, "Fast image retrieval.")
      .def_readonly("features_ms", &StepTimes::features_ms, "SURF.")
      .def_readonly("verification_ms", &StepTimes::verification_ms,
                    "Matching, geometry and decision.")
      .def("__repr__", [](const StepTimes& t) {
        return fmt::format(
            "StepTimes(content_ms={:.3f}, retrieval_ms={:.3f}, features_ms={:.3f}, "
            "verification_ms={:.3f})",
            t.content_ms, t.retrieval_ms, t.features_ms, t.verification_ms);
      });
  py::class_<Detection>(module, "Detection",
                        "The answer for one frame, with the numbers behind it.")
      .def_readonly("frame", &Detection::frame, "The frame's number, from 0.")
      .def_readonly("timestamp_s", &Detection::timestamp_s, "As it was given.")
      .def_readonly("status", &Detection::status, "Why it is a loop, or why not.")
      .def_readonly("match", &Detection::match, "The best candidate, accepted or not, or None.")
      .def_readonly("score", &Detection::score, "What was compared with decision.min_score.")
      .def_readonly("similarity", &Detection::similarity, "xi of frame and match.")
      .def_readonly("matches", &Detection::matches, "Features shared, one to one.")
      .def_readonly("inliers", &Detection::inliers, "Those that one epipolar geometry explains.")
      .def_readonly("times", &Detection::times, "The time of each step.")
      .def_property_readonly(
          "is_loop", [](const Detection& self) { return self.status == Status::loop; },
          "Whether the match is accepted.")
      .def("__repr__", &detection_text);
}

/// A row of Evidence.inliers.
struct PointPairRow {
  float query_x, query_y, match_x, match_y;
};

void bind_evidence(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PointPairRow, query_x, query_y, match_x, match_y);
  py::class_<Evidence>(module, "Evidence",
                       "What a detection rests on, for people to look at; process() fills it.")
      .def(py::init<>())
      .def_readonly("content", &Evidence::content, "The frame's binary content.")
      .def_property_readonly(
          "saliency", [](const Evidence& self) { return to_array(self.saliency); },
          "The frame's saliency map, float32, shape (64, 64); None before process().")
      .def_property_readonly(
          "inliers",
          [](const Evidence& self) {
            std::vector<PointPairRow> rows;
            rows.reserve(self.inliers.size());
            for (const auto& [query, match] : self.inliers) {
              rows.push_back({query.x, query.y, match.x, match.y});
            }
            return take(std::move(rows));
          },
          "Structured array of query_x, query_y, match_x and match_y, float32, each 0 to 1 of the "
          "image's width or height.")
      .def("__repr__", [](const Evidence& self) {
        return fmt::format("Evidence(inliers={})", self.inliers.size());
      });
}

}  // namespace

Detection SharedDetector::process(ImageArgument image, std::optional<double> timestamp_s,
                                  Evidence* evidence) {
  const cv::Mat pixels = to_image(image, "image");
  Detection detection;
  Evidence seen;
  {
    const FreeAndLocked guard(mutex_);
    detection = detector_.process(pixels, timestamp_s, evidence ? &seen : nullptr);
  }
  // With the GIL, for others may be reading it.
  if (evidence) *evidence = std::move(seen);
  return detection;
}

Detection SharedDetector::query(ImageArgument image, std::optional<double> timestamp_s) const {
  const cv::Mat pixels = to_image(image, "image");
  const FreeAndLocked guard(mutex_);
  return detector_.query(pixels, timestamp_s);
}

Detection SharedDetector::skip(std::optional<double> timestamp_s) {
  const FreeAndLocked guard(mutex_);
  return detector_.skip(timestamp_s);
}

PlaceId SharedDetector::size() const {
  const FreeAndLocked guard(mutex_);
  return detector_.size();
}

LoopDetectorOptions SharedDetector::options() const {
  const FreeAndLocked guard(mutex_);
  return detector_.options();
}

void bind_detector(py::module_& module) {
  bind_options(module);
  bind_detection(module);
  bind_evidence(module);
  py::class_<SharedDetector>(
      module, "LoopDetector",
      "Tells for each camera image whether the camera has been at this place before. Several "
      "threads may share one; it works for one at a time, without the GIL.")
      .def(py::init<const LoopDetectorOptions&>(),
           py::arg_v("options", LoopDetectorOptions{}, "LoopDetectorOptions()"))
      .def("process", &SharedDetector::process, py::arg("image"),
           py::arg("timestamp_s") = py::none(), py::arg("evidence") = py::none(),
           "Detects, then adds the image as the next place. The image: uint8 or uint16, (h, w), or "
           "BGR or BGRA, at least 32 x 32; not copied where its rows are contiguous. The time: not "
           "before the last one. The evidence, if given, is filled.")
      .def("query", &SharedDetector::query, py::arg("image"), py::arg("timestamp_s") = py::none(),
           "What process() would answer now, without adding anything.")
      .def("skip", &SharedDetector::skip, py::arg("timestamp_s") = py::none(),
           "Counts a frame without a usable image, so that numbers keep step with the camera.")
      .def("__len__", &SharedDetector::size)
      .def_property_readonly("options", &SharedDetector::options, "A copy of its settings.")
      .def("__repr__", [](const SharedDetector& self) {
        return fmt::format("LoopDetector({} frames)", self.size());
      });
}

}  // namespace loopbit::python
