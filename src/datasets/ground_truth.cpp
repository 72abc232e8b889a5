// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/ground_truth.hpp"

#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

#include "cells.hpp"
#include "text_rows.hpp"

namespace loopbit {
namespace {

using datasets::parse_frame;

std::optional<PlaceRun> parse_run(const std::vector<std::string_view>& cells) {
  if (cells.size() != 2 && cells.size() != 3) return std::nullopt;
  const auto query = parse_frame(cells[0]);
  const auto first = parse_frame(cells[1]);
  const auto last = parse_frame(cells.back());
  if (!query || !first || !last || *first > *last) return std::nullopt;
  return PlaceRun{*query, *first, *last};
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
  for (const auto& row : datasets::read_rows(path)) {
    datasets::split_cells(row.text, cells);
    const bool is_first = columns == 0;
    if (is_first) columns = cells.size();
    if (is_first && datasets::are_names(cells)) continue;
    const auto run = parse_run(cells);
    if (!run || cells.size() != columns) {
      datasets::throw_bad_row(path, row,
                              "query,first,last or, in all rows, query,match: frame numbers from "
                              "0, first <= last");
    }
    runs.push_back(*run);
  }
  return runs;
}

std::vector<int> read_frame_list(const std::string& path) {
  std::vector<int> list;
  for (const auto& row : datasets::read_rows(path)) {
    const std::string_view text = row.text;
    const auto frame = parse_frame(datasets::trimmed(text.substr(0, text.find(','))));
    if (!frame) datasets::throw_bad_row(path, row, "a frame number, then perhaps a remark");
    list.push_back(*frame);
  }
  return list;
}

GroundTruth every_nth(const GroundTruth& truth, int every) {
  if (every < 1) {
    throw Error(ErrorKind::option,
                fmt::format("every is {}, but must be 1 (all frames) or more.", every));
  }
  GroundTruth kept{thinned(truth.same_place, every), thinned(truth.near_place, every), {}};
  for (const int query : truth.ignored) {
    if (query % every == 0) kept.ignored.push_back(query / every);
  }
  return kept;
}

void write_place_runs(const std::string& path, const std::string& comment,
                      const std::vector<PlaceRun>& runs) {
  std::string text = fmt::format("# {}\n", comment);
  for (const PlaceRun& run : runs)
    text += fmt::format("{},{},{}\n", run.query, run.first, run.last);
  write_file(path, text);
}

}  // namespace loopbit
