// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "natural_order.hpp"

#include <algorithm>
#include <cstddef>

namespace loopbit::images {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a run of digits or one other character off the front of `text`, which is not empty.
std::string_view take_token(std::string_view& text) {
  std::size_t length = 1;
  if (is_digit(text.front())) {
    length = static_cast<std::size_t>(std::ranges::find_if_not(text, is_digit) - text.begin());
  }
  const std::string_view token = text.substr(0, length);
  text.remove_prefix(length);
  return token;
}

std::string_view without_leading_zeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

/// Negative, zero or positive, as std::string_view::compare.
int compare_tokens(std::string_view a, std::string_view b) {
  if (!is_digit(a.front()) || !is_digit(b.front())) return a.compare(b);
  a = without_leading_zeros(a);
  b = without_leading_zeros(b);
  if (a.size() != b.size()) return a.size() < b.size() ? -1 : 1;
  return a.compare(b);
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  std::string_view rest_a = a;
  std::string_view rest_b = b;
  while (!rest_a.empty() && !rest_b.empty()) {
    const std::string_view token_a = take_token(rest_a);
    const int order = compare_tokens(token_a, take_token(rest_b));
    if (order != 0) return order < 0;
  }
  if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
  return a < b;
}

}  // namespace loopbit::images
