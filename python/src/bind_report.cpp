// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <string>

#include <pybind11/stl/filesystem.h>

#include "loopbit/report.hpp"

#include "bindings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

void write_run_report(const FinishedRun& run, const std::filesystem::path& name,
                      const std::filesystem::path& path) {
  write_report(path.string(), {to_report_run(name.string(), run)});
}

}  // namespace

void bind_report(py::module_& module) {
  module.def("_write_report", &write_run_report, py::arg("run"), py::arg("name"), py::arg("path"),
             py::call_guard<WithoutGil>());
}

}  // namespace loopbit::python
