// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <pybind11/numpy.h>

namespace loopbit::python {

/// An argument that must be an array, or what numpy makes one of.
class ArrayLike : public pybind11::object {
 public:
  static bool accept(PyObject* object) { return object != nullptr && object != Py_None; }
  PYBIND11_OBJECT_DEFAULT(ArrayLike, pybind11::object, accept)
};

using FrameTable = pybind11::array_t<int, pybind11::array::c_style | pybind11::array::forcecast>;

// What an argument called `name` holds, with nothing rounded, wrapped or guessed. They throw
// TypeError for another dtype, and ValueError for another shape or for a bad value, and tell its
// row.

/// Numbers of frames, of any shape.
FrameTable to_frame_table(const ArrayLike& argument, const char* name);
/// Numbers of frames, one a row.
std::vector<int> to_frames(const ArrayLike& argument, const char* name);
/// Neither NaN nor infinite, one a row.
std::vector<double> to_numbers(const ArrayLike& argument, const char* name);
/// Truth values, also as 0 and 1, one a row.
std::vector<bool> to_flags(const ArrayLike& argument, const char* name);

}  // namespace loopbit::python

namespace pybind11::detail {

template <>
struct handle_type_name<loopbit::python::ArrayLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");  // NOLINT: pybind11's name
};

}  // namespace pybind11::detail
