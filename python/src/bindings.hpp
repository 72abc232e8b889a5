// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

#include "gil.hpp"

namespace loopbit::python {

// Each function adds one group of types and functions to the module. Their order is such that types
// come before their uses.
void bind_errors(pybind11::module_& module);
void bind_options(pybind11::module_& module);
void bind_content(pybind11::module_& module);
void bind_features(pybind11::module_& module);
void bind_relative_poses(pybind11::module_& module);
void bind_graph(pybind11::module_& module);
void bind_place_index(pybind11::module_& module);
void bind_map(pybind11::module_& module);
void bind_map_tools(pybind11::module_& module);
void bind_detector(pybind11::module_& module);
void bind_data(pybind11::module_& module);
void bind_evaluation(pybind11::module_& module);
void bind_run(pybind11::module_& module);
void bind_report(pybind11::module_& module);

/// Called between two frames of long work, with or without the GIL. Throws what signals raise, such
/// as KeyboardInterrupt.
inline void check_signals() {
  const WithGil acquire;
  if (unless_ended([] { return PyErr_CheckSignals(); }) != 0) throw pybind11::error_already_set();
}

/// An integer argument. It refuses fractions, which pybind11 would drop from foreign number types
/// such as numpy.float32.
inline pybind11::arg whole(const char* name) { return pybind11::arg(name).noconvert(); }

}  // namespace loopbit::python
