// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "loopbit/loop_detector.hpp"

namespace loopbit::python {

/// An argument that must name a place; to_place() raises the error if it does not.
class PlaceArgument : public pybind11::object {
 public:
  static bool accept(PyObject* object) { return object != nullptr; }
  PYBIND11_OBJECT_DEFAULT(PlaceArgument, pybind11::object, accept)
};

/// An argument that must be a Detection or name a place.
class QueryArgument : public pybind11::object {
 public:
  static bool accept(PyObject* object) { return object != nullptr; }
  PYBIND11_OBJECT_DEFAULT(QueryArgument, pybind11::object, accept)
};

/// An argument that must say which places are allowed, or None.
class AllowedArgument : public pybind11::object {
 public:
  static bool accept(PyObject* object) { return object != nullptr; }
  PYBIND11_OBJECT_DEFAULT(AllowedArgument, pybind11::object, accept)
};

/// A frame of the detector's own session, by its number, or a SessionFrame. Throws TypeError, which
/// calls the argument `name`.
SessionFrame to_place(const pybind11::handle& argument, const std::string& name);

/// What an AllowedArgument says. The function is called with the GIL, wherever it is asked from.
class Allowed {
 public:
  /// Throws TypeError unless `argument` is None, callable or a sequence of places.
  explicit Allowed(const AllowedArgument& argument);

  /// Valid as long as this and the argument.
  [[nodiscard]] AllowedPlaces places() const;

 private:
  pybind11::handle function_;
  bool is_list_ = false;
  std::vector<SessionFrame> list_;
};

}  // namespace loopbit::python

namespace pybind11::detail {

// NOLINTBEGIN: pybind11's names
template <>
struct handle_type_name<loopbit::python::PlaceArgument> {
  static constexpr auto name = const_name("int | loopbit.SessionFrame");
};

template <>
struct handle_type_name<loopbit::python::QueryArgument> {
  static constexpr auto name = const_name("loopbit.Detection | int | loopbit.SessionFrame");
};

template <>
struct handle_type_name<loopbit::python::AllowedArgument> {
  static constexpr auto name =
      const_name("Callable[[loopbit.SessionFrame], bool] | Sequence[int | loopbit.SessionFrame]");
};
// NOLINTEND

}  // namespace pybind11::detail
