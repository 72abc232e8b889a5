// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/ground_truth.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/text_rows.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit {
namespace {

std::optional<PlaceRun> parse_run(const std::vector<std::string_view>& cells) {
  if (cells.size() != 2 && cells.size() != 3) return std::nullopt;
  const auto query = parse_frame(cells[0]);
  const auto first = parse_frame(cells[1]);
  const auto last = parse_frame(cells.back());
  if (!query || !first || !last || *first > *last || *last >= *query) return std::nullopt;
  return PlaceRun{*query, *first, *last};
}

[[noreturn]] void throw_bad_names(const std::string& path, const TextRow& row) {
  throw_bad_row(path, row, "the names query,first,last or query,match in order");
}

/// Throws Error where a name stands in another's place.
void check_names(const std::string& path, const TextRow& row,
                 const std::vector<std::string_view>& names) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 5> kKnown{
      {{"query", 0}, {"frame", 0}, {"match", 1}, {"first", 1}, {"last", 2}}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const auto& [name, column] : kKnown) {
      if (names[i] == name && i != column) throw_bad_names(path, row);
    }
  }
  // Of what has been found, the third column is a score.
  if (names.size() == 3 && (names[1] == "match" || names[2] == "score")) throw_bad_names(path, row);
}

/// Whether the names say by themselves that these are places, as they must where no row does.
bool name_places(const std::vector<std::string_view>& names) {
  return names.size() > 1 && (names[0] == "query" || names[0] == "frame") &&
         (names[1] == "match" || names[1] == "first");
}

std::vector<int> thinned(const std::vector<int>& frames, int every) {
  std::vector<int> kept;
  for (const int frame : frames) {
    if (frame % every == 0) kept.push_back(frame / every);
  }
  return kept;
}

std::vector<PlaceRun> thinned(const std::vector<PlaceRun>& runs, int every) {
  std::vector<PlaceRun> kept;
  for (const PlaceRun& run : runs) {
    if (run.query % every != 0) continue;
    const int first = run.first / every + (run.first % every != 0 ? 1 : 0);
    const int last = run.last / every;
    if (first <= last) kept.push_back({run.query / every, first, last});
  }
  return kept;
}

}  // namespace

std::vector<PlaceRun> read_place_runs(const std::string& path) {
  std::vector<PlaceRun> runs;
  std::vector<std::string_view> cells;
  std::size_t columns = 0;
  std::optional<TextRow> odd_names;
  for (const auto& row : read_rows(path)) {
    split_cells(row.text, cells);
    const bool is_first = columns == 0;
    if (is_first) columns = cells.size();
    if (is_first && are_names(cells)) {
      check_names(path, row, cells);
      if (!name_places(cells)) odd_names = row;
      continue;
    }
    const auto run = parse_run(cells);
    if (!run || cells.size() != columns) {
      throw_bad_row(path, row,
                    "query,first,last or, in all rows, query,match: frame numbers from "
                    "0, first <= last < query");
    }
    runs.push_back(*run);
  }
  if (runs.empty() && odd_names) throw_bad_names(path, *odd_names);
  return runs;
}

std::vector<int> read_frame_list(const std::string& path) {
  std::vector<int> list;
  for (const auto& row : read_rows(path)) {
    const std::string_view text = row.text;
    const auto frame = parse_frame(trimmed(text.substr(0, text.find(','))));
    if (!frame) throw_bad_row(path, row, "a frame number, then perhaps a remark");
    list.push_back(*frame);
  }
  return list;
}

void check_every(int every) {
  if (every >= 1) return;
  throw Error(ErrorKind::option,
              fmt::format("every is {}, but must be 1 (all frames) or more.", every));
}

GroundTruth every_nth(const GroundTruth& truth, int every) {
  check_every(every);
  return {.same_place = thinned(truth.same_place, every),
          .near_place = thinned(truth.near_place, every),
          .ignored = thinned(truth.ignored, every),
          .unknown = thinned(truth.unknown, every),
          .frames = truth.frames / every + (truth.frames % every != 0 ? 1 : 0)};
}

void write_place_runs(const std::string& path, const std::string& comment,
                      const std::vector<PlaceRun>& runs) {
  std::string text = fmt::format("# {}\n", comment);
  if (runs.empty()) text += "query,first,last\n";  // as truth, a file without a row says nothing
  for (const PlaceRun& run : runs)
    text += fmt::format("{},{},{}\n", run.query, run.first, run.last);
  write_file(path, text);
}

}  // namespace loopbit
