// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>

#include <pybind11/pybind11.h>

namespace loopbit::python {

/// Text for Python that may contain a file name, which may not be UTF-8. It becomes a str like the
/// file names of Python's own functions.
struct Text {
  std::string bytes;
};

/// A member of type std::string, as a property.
template <typename Struct>
auto text_of(std::string Struct::*member) {
  return [member](const Struct& self) { return Text{self.*member}; };
}

}  // namespace loopbit::python

namespace pybind11::detail {

// NOLINTBEGIN: pybind11's names
template <>
struct type_caster<loopbit::python::Text> {
  PYBIND11_TYPE_CASTER(loopbit::python::Text, const_name("str"));

  static handle cast(const loopbit::python::Text& text, return_value_policy, handle) {
    return PyUnicode_DecodeFSDefaultAndSize(text.bytes.data(),
                                            static_cast<Py_ssize_t>(text.bytes.size()));
  }
};
// NOLINTEND

}  // namespace pybind11::detail
