// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/match_list.hpp"

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/text_rows.hpp"

namespace loopbit {
namespace {

using Cells = std::vector<std::string_view>;

/// Where each column stands.
struct Columns {
  std::size_t count = 0;
  std::optional<std::size_t> frame;
  std::optional<std::size_t> query;
  std::optional<std::size_t> match;
  std::optional<std::size_t> score;
  std::optional<std::size_t> status;
  std::optional<std::size_t> timestamp;
};

[[noreturn]] void throw_bad_names(const std::string& path, const TextRow& row,
                                  std::string_view what) {
  throw Error(
      ErrorKind::input,
      fmt::format("'{}', line {}, names {}: name 'query' (or 'frame') and 'match' once, and "
                  "perhaps 'score', 'status' and 'timestamp'.",
                  path, row.line, what));
}

Columns named_columns(const std::string& path, const TextRow& row, const Cells& names) {
  Columns columns;
  columns.count = names.size();
  const std::array<std::pair<std::string_view, std::optional<std::size_t>*>, 6> known{
      {{"frame", &columns.frame},
       {"query", &columns.query},
       {"match", &columns.match},
       {"score", &columns.score},
       {"status", &columns.status},
       {"timestamp", &columns.timestamp}}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const auto& [name, column] : known) {
      if (names[i] != name) continue;
      if (*column) throw_bad_names(path, row, fmt::format("'{}' twice", name));
      *column = i;
    }
  }
  if (!columns.match) throw_bad_names(path, row, "no column 'match'");
  if (columns.frame.has_value() == columns.query.has_value()) {
    throw_bad_names(path, row, columns.frame ? "both 'frame' and 'query'" : "no column 'query'");
  }
  return columns;
}

Columns unnamed_columns(const std::string& path, const TextRow& row, const Cells& cells) {
  if (cells.size() != 2 && cells.size() != 3) {
    throw_bad_row(path, row,
                  "query,match or query,match,score, or the first must name the columns");
  }
  Columns columns;
  columns.count = cells.size();
  columns.query = 0;
  columns.match = 1;
  if (cells.size() == 3) columns.score = 2;
  return columns;
}

class Reader {
 public:
  Reader(const std::string& path, Columns columns) : path_(path), columns_(columns) {}

  void read(const TextRow& row, const Cells& cells) {
    if (cells.size() != columns_.count) {
      throw_bad_row(path_, row, fmt::format("{} cells, not {}", columns_.count, cells.size()));
    }
    const int query = frame(row, cells[columns_.frame ? *columns_.frame : *columns_.query]);
    if (columns_.frame) begin_frame(row, cells, query);
    const std::string_view cell = cells[*columns_.match];
    const bool is_loop = !columns_.status || cells[*columns_.status] == "loop";
    if (cell.empty()) return;
    if (is_elsewhere(cell)) {
      if (is_loop) list_.elsewhere.push_back(query);
      return;
    }
    const int match = frame(row, cell);
    if (match >= query) {
      throw_bad_row(path_, row, fmt::format("an earlier frame as the match of {}", query));
    }
    list_.matches.push_back({.query = query,
                             .match = match,
                             .score = columns_.score ? number(row, cells[*columns_.score]) : 1.0,
                             .is_loop = is_loop});
  }

  MatchList take() { return std::move(list_); }

 private:
  /// As loopbit writes a match in another recording: "session:frame".
  [[nodiscard]] bool is_elsewhere(std::string_view cell) const {
    return columns_.frame && cell.find(':') != std::string_view::npos;
  }

  void begin_frame(const TextRow& row, const Cells& cells, int frame) {
    const std::size_t expected = list_.times_s.size();
    if (static_cast<std::size_t>(frame) != expected) {
      throw_bad_row(path_, row, fmt::format("frame {} (frames must be consecutive)", expected));
    }
    const bool has_time = columns_.timestamp && !cells[*columns_.timestamp].empty();
    list_.times_s.emplace_back();
    if (has_time) list_.times_s.back() = number(row, cells[*columns_.timestamp]);
  }

  [[nodiscard]] int frame(const TextRow& row, std::string_view cell) const {
    const auto frame = parse_frame(cell);
    if (!frame) {
      throw_bad_row(path_, row, fmt::format("of frame numbers from 0 ('{}' is not one)", cell));
    }
    return *frame;
  }

  [[nodiscard]] double number(const TextRow& row, std::string_view cell) const {
    const auto number = parse_number<double>(cell);
    if (!number) {
      throw_bad_row(path_, row, fmt::format("of finite numbers ('{}' is not one)", cell));
    }
    return *number;
  }

  const std::string& path_;
  Columns columns_;
  MatchList list_;
};

}  // namespace

MatchList with_changes(MatchList list) {
  for (const ReportedMatch& change : list.changes) {
    const auto is_changed = [&](const ReportedMatch& match) {
      return match.query == change.query && match.match == change.match;
    };
    if (change.match < 0 && change.is_loop) {
      list.elsewhere.push_back(change.query);
    } else if (change.match < 0) {
      std::erase(list.elsewhere, change.query);
    } else if (change.is_loop) {
      list.matches.push_back(change);
    } else {
      for (ReportedMatch& match : list.matches) match.is_loop &= !is_changed(match);
    }
  }
  list.changes.clear();
  return list;
}

MatchList read_match_list(const std::string& path) {
  const std::vector<TextRow> rows = read_rows(path);
  if (rows.empty()) return {};
  Cells cells;
  split_cells(rows.front().text, cells);
  const bool named = are_names(cells);
  Reader reader(path, named ? named_columns(path, rows.front(), cells)
                            : unnamed_columns(path, rows.front(), cells));
  for (std::size_t i = named ? 1 : 0; i < rows.size(); ++i) {
    split_cells(rows[i].text, cells);
    reader.read(rows[i], cells);
  }
  return reader.take();
}

}  // namespace loopbit
