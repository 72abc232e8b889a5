// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include <pybind11/stl/filesystem.h>

#include "loopbit/loop_detector_options.hpp"

#include "bindings.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

std::string class_name(std::string_view section) {
  std::string name;
  bool upper = true;
  for (const char c : section) {
    if (c != '_') name += upper ? static_cast<char>(c - 'a' + 'A') : c;
    upper = c == '_';
  }
  return name + "Options";
}

/// The section `name` of `options`, as a reference into it, or null.
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
    const std::string doc =
        fmt::format("{}: a reference; changing it changes these options", class_name(name));
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

}  // namespace

void bind_options(py::module_& module) {
  LoopDetectorOptions sections;
  for_each_section(sections, [&](const char* name, const auto& part) {
    using Part = std::remove_cvref_t<decltype(part)>;
    bind_settings<Part>(module, class_name(name).c_str(), name,
                        fmt::format("Section '{}' of the settings.", name));
  });
  py::class_<LoopDetectorOptions> type(
      module, "LoopDetectorOptions",
      "All settings of a LoopDetector, by section. The defaults are meant for all data.");
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
      py::arg("options"), "The settings as JSON, for load_options() or --config.");
  module.def("options_from_json", &options_from_json, py::arg("json"), py::arg("source") = "json",
             "The defaults, changed by the settings in the JSON text. Errors mention source.");
  module.def(
      "load_options", [](const std::filesystem::path& path) { return load_options(path.string()); },
      py::arg("path"), py::call_guard<WithoutGil>(),
      "Reads a settings file; see options_from_json().");
  module.def(
      "set_option",
      [](LoopDetectorOptions& options, const std::string& name, const py::object& value) {
        py::detail::make_caster<bool> truth;  // NumPy's bools, too
        const std::string text = truth.load(value, false)
                                     ? py::detail::cast_op<bool>(truth) ? "true" : "false"
                                     : std::string(py::str(value));
        set_option(options, name, text);
      },
      py::arg("options"), py::arg("name"), py::arg("value"),
      "Sets one setting by its full name, such as set_option(options, 'surf.max_keypoints', 500).");
  module.def(
      "validate", [](const LoopDetectorOptions& options) { validate(options); }, py::arg("options"),
      "Raises OptionError if settings contradict each other.");
}

}  // namespace loopbit::python
