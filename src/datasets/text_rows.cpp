// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "text_rows.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit::datasets {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxTextBytes = std::uintmax_t{1} << 30U;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Fit for a one-line message: control characters are replaced, and a UTF-8 character is not cut.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kMaxBytes = 80;
  std::size_t end = std::min(text.size(), kMaxBytes);
  while (end > 0 && end < text.size() && (text[end] & 0xC0) == 0x80) --end;
  std::string shown(text.substr(0, end));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return end < text.size() ? shown + "..." : shown;
}

[[noreturn]] void throw_unreadable(const fs::path& file) {
  if (errno == ENOENT) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' does not exist: correct the path.", file.string()));
  }
  throw Error(ErrorKind::input, fmt::format("'{}' cannot be read ({}): check its permissions.",
                                            file.string(), std::generic_category().message(errno)));
}

}  // namespace

std::vector<TextRow> read_rows(const fs::path& file) {
  std::error_code error;
  if (const auto bytes = fs::file_size(file, error); !error && bytes > kMaxTextBytes) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' has {} bytes, but at most {} of text are read: split it.",
                            file.string(), bytes, kMaxTextBytes));
  }
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw_unreadable(file);
  std::vector<TextRow> rows;
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    std::string_view text = line;
    if (number == 1 && text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    text = trimmed(text);
    if (!text.empty() && text.front() != '#') rows.push_back({number, std::string(text)});
  }
  if (stream.bad()) throw_unreadable(file);
  return rows;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

void throw_bad_row(const fs::path& file, const TextRow& row, std::string_view rule) {
  throw Error(ErrorKind::input,
              fmt::format("'{}', line {}, reads '{}', but each row must be {}: correct the line or "
                          "begin it with # to leave it out.",
                          file.string(), row.line, excerpt(row.text), rule));
}

}  // namespace loopbit::datasets
