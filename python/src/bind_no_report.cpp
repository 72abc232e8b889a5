// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <stdexcept>

#include "bindings.hpp"

namespace loopbit::python {

// In place of bind_report.cpp where the page was not built, for which Node.js is needed.
void bind_report(pybind11::module_& module) {
  module.def("_write_report", [](const pybind11::args&) {
    throw std::runtime_error(
        "This loopbit was built without the report page, for which Node.js 18.18 or later, npm "
        "and, "
        "once, a network are needed; install them, then loopbit again, or use the command 'loopbit "
        "report'.");
  });
}

}  // namespace loopbit::python
