// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/options.hpp"

#include <charconv>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit::detail {
namespace {

template <typename Number>
void parse_number(const std::string& text, const std::string& name, const char* kind,
                  Number& value) {
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, value);
  if (parsed.ec == std::errc{} && parsed.ptr == end) return;
  if (parsed.ec == std::errc::result_out_of_range && parsed.ptr == end) {
    kind = "within the range of its type";
  }
  throw Error(ErrorKind::option, fmt::format("{} is '{}', but must be {}.", name, text, kind));
}

}  // namespace

void check_range(std::string_view section, std::string_view name, double value, double min,
                 double max) {
  if (value >= min && value <= max) return;
  throw Error(ErrorKind::option, fmt::format("{}.{} is {}, but must be between {} and {}.", section,
                                             name, value, min, max));
}

void parse_value(const std::string& text, const std::string& name, int& value) {
  parse_number(text, name, "a whole number", value);
}

void parse_value(const std::string& text, const std::string& name, double& value) {
  parse_number(text, name, "a number", value);
}

void parse_value(const std::string& text, const std::string& name, bool& value) {
  if (text != "true" && text != "false") {
    throw Error(ErrorKind::option,
                fmt::format("{} is '{}', but must be true or false.", name, text));
  }
  value = text == "true";
}

}  // namespace loopbit::detail
