// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "cells.hpp"

#include <algorithm>

#include "text_rows.hpp"

namespace loopbit::datasets {
namespace {

constexpr std::string_view kBlanks = " \t";

void split_at_commas(std::string_view row, std::vector<std::string_view>& cells) {
  for (std::size_t comma = row.find(','); comma != std::string_view::npos; comma = row.find(',')) {
    cells.push_back(trimmed(row.substr(0, comma)));
    row.remove_prefix(comma + 1);
  }
  cells.push_back(trimmed(row));
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

}  // namespace loopbit::datasets
