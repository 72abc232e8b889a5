// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <stdexcept>

#include "bindings.hpp"

namespace loopbit::python {

// In place of bind_report.cpp where the page was not built, for which Node.js is needed.
void bind_report(pybind11::module_& module) {
  module.def("_write_report", [](const pybind11::args&) {
    throw std::runtime_error(
        "This loopbit was built without the report page; build it with Node.js and "
        "LOOPBIT_BUILD_REPORT=ON, or use the command 'loopbit report'.");
  });
}

}  // namespace loopbit::python
