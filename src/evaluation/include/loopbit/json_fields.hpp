// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/error.hpp"

namespace loopbit {

// A struct that is kept as JSON lists its fields once, in a function that takes a JsonWriter or a
// JsonReader. The place of a value is like "/input/every". Not installed.

/// Writes values to JSON.
class JsonWriter {
 public:
  using Json = nlohmann::ordered_json;

  explicit JsonWriter(Json& json) : json_(json) {}

  template <typename Value>
  void operator()(const std::string& place, const Value& value, double /*min*/ = 0,
                  double /*max*/ = 0) {
    json_[Json::json_pointer(place)] = value;
  }

  /// Leaves out the usual value.
  template <typename Value>
  void unless(const Value& usual, const std::string& place, const Value& value,
              double /*min*/ = 0) {
    if (value != usual) (*this)(place, value);
  }

  /// Writes null for an empty value.
  void or_null(const std::string& place, const std::string& value) {
    (*this)(place, value.empty() ? Json() : Json(value));
  }
  void or_null(const std::string& place, const std::optional<double>& value) {
    (*this)(place, value ? Json(*value) : Json());
  }

  /// A value that others determine, which is not read.
  template <typename Value>
  void derived(const std::string& place, const Value& value) {
    (*this)(place, value);
  }

 private:
  Json& json_;
};

/// Reads values from JSON. Those that are missing or null stay as they are. Throws Error (kind
/// input) that names `file`, the place and the value.
class JsonReader {
 public:
  using Json = nlohmann::ordered_json;
  static constexpr double kMax = std::numeric_limits<int>::max();

  JsonReader(const Json& json, const std::string& file) : json_(json), file_(file) {}

  template <typename Value>
  void operator()(const std::string& place, Value& value, double min = 0, double max = kMax) const {
    const Json* found = find(place);
    if (!found) return;
    if (!is_a<Value>(*found)) fail(place, *found);
    if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>) {
      const auto number = found->template get<double>();
      if (number < min || number > max) fail(place, *found);
    }
    value = found->template get<Value>();
  }

  template <typename Value>
  void unless(const Value& /*usual*/, const std::string& place, Value& value,
              double min = 0) const {
    (*this)(place, value, min);
  }

  void or_null(const std::string& place, std::string& value) const { (*this)(place, value); }
  void or_null(const std::string& place, std::optional<double>& value) const {
    if (find(place)) (*this)(place, value.emplace());
  }

  template <typename Value>
  void derived(const std::string& /*place*/, const Value& /*value*/) const {}

  /// What is at `place`; null if nothing is. Throws Error if something above it is no object.
  [[nodiscard]] const Json* find(const std::string& place) const {
    const Json* found = &json_;
    for (std::size_t begin = 0; begin < place.size();) {
      if (!found->is_object()) fail(place.substr(0, begin), *found);
      const std::size_t end = std::min(place.find('/', begin + 1), place.size());
      const auto child = found->find(place.substr(begin + 1, end - begin - 1));
      if (child == found->end() || child->is_null()) return nullptr;
      found = &*child;
      begin = end;
    }
    return found;
  }

  [[noreturn]] void fail(std::string_view fault) const {
    throw Error(ErrorKind::input,
                fmt::format("'{}' {}: it is no record of a run, or was changed after loopbit wrote "
                            "it; run again, or delete the file to go on without it.",
                            file_, fault));
  }

 private:
  [[noreturn]] void fail(std::string place, const Json& value) const {
    std::replace(place.begin(), place.end(), '/', '.');
    // A dump would recurse into what is nested, however deep.
    const std::string text =
        value.is_structured()
            ? fmt::format("an {}", value.type_name())
            : value.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 40);
    fail(
        fmt::format("has {} for '{}'", text, place.substr(std::min<std::size_t>(1, place.size()))));
  }

  template <typename Value>
  static bool is_a(const Json& json) {
    if constexpr (std::is_same_v<Value, bool>) {
      return json.is_boolean();
    } else if constexpr (std::is_integral_v<Value>) {
      return json.is_number_integer();
    } else if constexpr (std::is_arithmetic_v<Value>) {
      return json.is_number();
    } else if constexpr (std::is_same_v<Value, std::string>) {
      return json.is_string();
    } else {  // a list of strings
      return json.is_array() && std::all_of(json.begin(), json.end(),
                                            [](const Json& item) { return item.is_string(); });
    }
  }

  const Json& json_;
  const std::string& file_;
};

}  // namespace loopbit
