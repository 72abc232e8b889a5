// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <type_traits>

#include <fmt/format.h>
#include <pybind11/pybind11.h>

#include "loopbit/options.hpp"

namespace loopbit::python {

/// The Python literal of a value.
inline std::string literal(const pybind11::handle& value) { return pybind11::repr(value); }

template <typename Value>
const char* python_type() {
  if constexpr (std::is_same_v<Value, bool>) return "bool";
  return std::is_same_v<Value, int> ? "int" : "float";
}

/// Converts `value` to C++. Throws TypeError, which calls it `name`.
template <typename Value>
Value cast_value(const pybind11::handle& value, const std::string& name) {
  pybind11::detail::make_caster<Value> caster;
  // Stricter than Python, which accepts any object as a bool and a Decimal as an int.
  constexpr bool kConvert = std::is_same_v<Value, double>;
  if (!caster.load(value, kConvert)) {
    throw pybind11::type_error(
        fmt::format("{} is {}, but must be {}.", name, literal(value), python_type<Value>()));
  }
  return pybind11::detail::cast_op<Value>(caster);
}

/// Sets one field of an options struct. Throws TypeError, or Error if it is out of range.
template <typename Struct, typename Value>
void set_setting(Struct& options, const Field<Struct, Value>& field, const std::string& section,
                 const pybind11::handle& value) {
  const Value cast = cast_value<Value>(value, section + '.' + std::string(field.name));
  detail::check_range(section, field.name, static_cast<double>(cast),
                      static_cast<double>(field.min), static_cast<double>(field.max));
  options.*field.member = cast;
}

/// Sets the field that a keyword argument names. Throws TypeError if there is none.
template <typename Struct>
void set_keyword(Struct& options, const std::string& section, const std::string& keyword,
                 const pybind11::handle& value) {
  bool found = false;
  for_each_field<Struct>([&](const auto& field) {
    if (field.name != keyword) return;
    set_setting(options, field, section, value);
    found = true;
  });
  if (!found) {
    throw pybind11::type_error(fmt::format("There is no setting '{}.{}'.", section, keyword));
  }
}

template <typename Struct>
std::string settings_text(const Struct& options, const char* format) {
  std::string text;
  for_each_field<Struct>([&](const auto& field) {
    using Value = std::remove_cvref_t<decltype(options.*field.member)>;
    if (!text.empty()) text += ", ";
    text += fmt::format(fmt::runtime(format), fmt::arg("name", field.name),
                        fmt::arg("type", python_type<Value>()),
                        fmt::arg("value", literal(pybind11::cast(options.*field.member))));
  });
  return text;
}

/// Binds an options struct by its fields(): one keyword and one property per field, with its help,
/// range and default.
template <typename Struct>
void bind_settings(pybind11::module_& module, const char* name, const std::string& section,
                   const std::string& doc) {
  namespace py = pybind11;
  py::options no_signatures;
  no_signatures.disable_function_signatures();
  py::class_<Struct> type(module, name, doc.c_str());
  const std::string signature = fmt::format("__init__(self, *, {}) -> None",
                                            settings_text(Struct{}, "{name}: {type} = {value}"));
  type.def(py::init([section](const py::kwargs& keywords) {
             Struct options;
             for (const auto& [keyword, value] : keywords) {
               set_keyword(options, section, py::str(keyword), value);
             }
             return options;
           }),
           signature.c_str());
  for_each_field<Struct>([&](const auto& field) {
    using Value = std::remove_cvref_t<decltype(Struct{}.*field.member)>;
    const std::string help =
        fmt::format("{}: {}; {} to {}, default {}", python_type<Value>(), field.help,
                    literal(py::cast(field.min)), literal(py::cast(field.max)),
                    literal(py::cast(Struct{}.*field.member)));
    type.def_property(
        field.name.data(), [field](const Struct& options) { return options.*field.member; },
        [field, section](Struct& options, const py::object& value) {
          set_setting(options, field, section, value);
        },
        help.c_str());
  });
  type.def(
      "__repr__",
      [name = std::string(name)](const Struct& options) {
        return fmt::format("{}({})", name, settings_text(options, "{name}={value}"));
      },
      "__repr__(self) -> str");
}

}  // namespace loopbit::python
