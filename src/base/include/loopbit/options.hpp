// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace loopbit {

/// One setting of an options struct: its name, its member, its range (inclusive) and one line of
/// help. Every options struct lists its settings in `static constexpr auto fields()`. Validation,
/// settings files, the command and its help read that list. Defaults are only in the struct.
template <typename Struct, typename Value>
struct Field {
  static_assert(std::is_same_v<Value, int> || std::is_same_v<Value, double> ||
                std::is_same_v<Value, bool>);

  std::string_view name;
  Value Struct::*member;
  Value min;
  Value max;
  std::string_view help;
};

template <typename Struct, typename Value>
Field(const char*, Value Struct::*, std::type_identity_t<Value>, std::type_identity_t<Value>,
      const char*) -> Field<Struct, Value>;

/// A switch: false or true.
template <typename Struct>
constexpr Field<Struct, bool> switch_field(std::string_view name, bool Struct::*member,
                                           std::string_view help) {
  return {name, member, false, true, help};
}

/// Calls visit(field) for each field of Struct, in the order of declaration.
template <typename Struct, typename Visit>
void for_each_field(Visit&& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, Struct::fields());
}

namespace detail {

/// Throws Error (kind option): `section.name is value, but must be between min and max`.
void check_range(std::string_view section, std::string_view name, double value, double min,
                 double max);

/// Parses all of `text` as an integer, a number, or "true" / "false". Errors mention `name`. Throws
/// Error (kind option) if `text` is not such a value.
void parse_value(const std::string& text, const std::string& name, int& value);
void parse_value(const std::string& text, const std::string& name, double& value);
void parse_value(const std::string& text, const std::string& name, bool& value);

}  // namespace detail

/// Throws Error for the first field of `options` that is outside its range (NaN is).
template <typename Struct>
void validate(const Struct& options, std::string_view section) {
  for_each_field<Struct>([&](const auto& field) {
    detail::check_range(section, field.name, static_cast<double>(options.*field.member),
                        static_cast<double>(field.min), static_cast<double>(field.max));
  });
}

/// Sets the field `name`; returns false if there is none. Throws Error (kind option) if `text` has
/// the wrong type or is out of range; the field is then unchanged.
template <typename Struct>
bool set_field(Struct& options, std::string_view section, std::string_view name,
               const std::string& text) {
  bool found = false;
  for_each_field<Struct>([&](const auto& field) {
    if (field.name != name) return;
    auto value = options.*field.member;
    detail::parse_value(text, std::string(section) + '.' + std::string(name), value);
    detail::check_range(section, name, static_cast<double>(value), static_cast<double>(field.min),
                        static_cast<double>(field.max));
    options.*field.member = value;
    found = true;
  });
  return found;
}

}  // namespace loopbit
