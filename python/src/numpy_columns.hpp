// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <pybind11/numpy.h>

namespace loopbit::python {

/// An argument that must be an array or convertible to one.
class ArrayLike : public pybind11::object {
 public:
  static bool accept(PyObject* object) { return object != nullptr && object != Py_None; }
  PYBIND11_OBJECT_DEFAULT(ArrayLike, pybind11::object, accept)
};

using FrameTable = pybind11::array_t<int, pybind11::array::c_style | pybind11::array::forcecast>;

// Convert an argument called `name` without rounding, wrapping or guessing. They throw TypeError
// for another dtype, and ValueError with the row for another shape or a bad value.

/// Frame numbers of any shape.
FrameTable to_frame_table(const ArrayLike& argument, const char* name);
/// Frame numbers, one per row.
std::vector<int> to_frames(const ArrayLike& argument, const char* name);
/// Finite numbers, one per row.
std::vector<double> to_numbers(const ArrayLike& argument, const char* name);
/// Booleans, also as 0 and 1, one per row.
std::vector<bool> to_flags(const ArrayLike& argument, const char* name);

}  // namespace loopbit::python

namespace pybind11::detail {

template <>
struct handle_type_name<loopbit::python::ArrayLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");  // NOLINT: pybind11's name
};

}  // namespace pybind11::detail
