// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/printable.hpp"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

namespace loopbit {
namespace {

/// The bytes of the UTF-8 character at the beginning of `text`; 1 where there is none.
std::size_t character_bytes(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC2 ? 2 : 1;
  const auto follows = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80; };
  if (lead > 0xF4 || bytes > text.size()) return 1;
  return std::ranges::all_of(text.substr(1, bytes - 1), follows) ? bytes : 1;
}

/// Of C0, DEL, or of C1: U+0080 to U+009F, or as single bytes, which are not UTF-8.
bool is_control(std::string_view character) {
  const auto lead = static_cast<unsigned char>(character.front());
  if (character.size() == 2) return lead == 0xC2 && static_cast<unsigned char>(character[1]) < 0xA0;
  return character.size() == 1 && (lead < 0x20 || (lead >= 0x7F && lead < 0xA0));
}

/// `text` with escape(result, character) in place of each control character.
template <typename Escape>
std::string escaped(std::string_view text, const Escape& escape) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const std::string_view character = text.substr(0, character_bytes(text));
    text.remove_prefix(character.size());
    if (is_control(character)) {
      escape(shown, character);
    } else {
      shown += character;
    }
  }
  return shown;
}

}  // namespace

std::string printable(std::string_view text) {
  return escaped(text, [](std::string& shown, std::string_view control) {
    for (const char c : control) {
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
  });
}

std::string printable_json(std::string_view json) {
  return escaped(json, [](std::string& shown, std::string_view control) {
    const auto code = static_cast<unsigned char>(control.back());  // C1 is 0xC2 and its code
    if (code < 0x20) {
      shown += control;  // between values: JSON itself escapes these within them
    } else {
      shown += fmt::format("\\u{:04x}", code);
    }
  });
}

}  // namespace loopbit
