// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/text_rows.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/read_file.hpp"

namespace loopbit {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Fit for a message: printable, on one line and short. A UTF-8 character is not cut.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kMaxBytes = 80;
  std::size_t end = std::min(text.size(), kMaxBytes);
  while (end > 0 && end < text.size() && (text[end] & 0xC0) == 0x80) --end;
  return printable(text.substr(0, end)) + (end < text.size() ? "..." : "");
}

/// Calls visit(part) with what stands before, between and after the separators.
template <typename Visit>
void for_each_part(std::string_view text, char separator, const Visit& visit) {
  for (std::size_t end = text.find(separator); end != std::string_view::npos;
       end = text.find(separator)) {
    visit(text.substr(0, end));
    text.remove_prefix(end + 1);
  }
  visit(text);
}

std::vector<TextRow> rows_of(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::vector<TextRow> rows;
  std::size_t number = 0;
  for_each_part(text, '\n', [&](std::string_view line) {
    ++number;
    line = trimmed(line);
    if (!line.empty() && line.front() != '#') rows.push_back({number, std::string(line)});
  });
  return rows;
}

constexpr std::string_view kBlanks = " \t";

void split_at_commas(std::string_view row, std::vector<std::string_view>& cells) {
  for_each_part(row, ',', [&](std::string_view cell) { cells.push_back(trimmed(cell)); });
}

void split_at_blanks(std::string_view row, std::vector<std::string_view>& cells) {
  std::size_t begin = row.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(row.find_first_of(kBlanks, begin), row.size());
    cells.push_back(row.substr(begin, end - begin));
    begin = row.find_first_not_of(kBlanks, end);
  }
}

bool begins_with_letter(std::string_view cell) {
  if (cell.empty()) return false;
  const char lower = static_cast<char>(cell.front() | 0x20);
  return lower >= 'a' && lower <= 'z';
}

}  // namespace

std::vector<TextRow> read_rows(const fs::path& file) { return rows_of(read_text(file.string())); }

std::vector<TextRow> read_listed_rows(const fs::path& file) {
  const std::string text = read_file(file.string());
  if (text.find('\0') == std::string::npos) return rows_of(text);
  std::vector<TextRow> rows;
  std::size_t number = 0;
  for_each_part(text, '\0', [&](std::string_view name) {
    ++number;
    if (!name.empty()) rows.push_back({number, std::string(name)});
  });
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

std::optional<int> parse_frame(std::string_view text) {
  const auto frame = parse_number<int>(text);
  return frame && *frame >= 0 ? frame : std::nullopt;
}

void split_cells(std::string_view row, std::vector<std::string_view>& cells) {
  cells.clear();
  if (row.find(',') == std::string_view::npos) {
    split_at_blanks(row, cells);
  } else {
    split_at_commas(row, cells);
  }
}

bool are_names(const std::vector<std::string_view>& cells) {
  return !cells.empty() && std::ranges::all_of(cells, begins_with_letter);
}

}  // namespace loopbit
