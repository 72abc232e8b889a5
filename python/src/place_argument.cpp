// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_argument.hpp"

#include <span>

#include <fmt/format.h>

#include "gil.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

bool call(const py::handle& function, const SessionFrame& place) {
  const WithGil acquire;
  const py::object argument = py::cast(place);
  const auto result = py::reinterpret_steal<py::object>(unless_ended(
      [&] { return PyObject_CallFunctionObjArgs(function.ptr(), argument.ptr(), nullptr); }));
  const int is_true = result ? unless_ended([&] { return PyObject_IsTrue(result.ptr()); }) : -1;
  if (is_true < 0) throw py::error_already_set();
  return is_true == 1;
}

}  // namespace

SessionFrame to_place(const py::handle& argument, const std::string& name) {
  if (py::isinstance<SessionFrame>(argument)) return argument.cast<SessionFrame>();
  py::detail::make_caster<int> frame;
  if (PyIndex_Check(argument.ptr()) != 0 && frame.load(argument, true)) {
    return {0, py::detail::cast_op<int>(frame)};
  }
  throw py::type_error(fmt::format("{} is {}, but must be the number of a frame or a SessionFrame.",
                                   name, literal(argument)));
}

Allowed::Allowed(const AllowedArgument& argument) {
  if (argument.is_none()) return;
  if (PyCallable_Check(argument.ptr()) != 0) {
    function_ = argument;
    return;
  }
  is_list_ = true;
  if (PySequence_Check(argument.ptr()) == 0 || py::isinstance<py::str>(argument)) {
    throw py::type_error(fmt::format(
        "allowed is {}, but must be a function or a sequence of places.", literal(argument)));
  }
  for (const py::handle& place : argument) {
    list_.push_back(to_place(place, fmt::format("allowed[{}]", list_.size())));
  }
}

AllowedPlaces Allowed::places() const {
  if (is_list_) return std::span(list_);
  if (!function_) return {};
  return [function = function_](const SessionFrame& place) { return call(function, place); };
}

}  // namespace loopbit::python
