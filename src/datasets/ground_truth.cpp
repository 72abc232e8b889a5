// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/ground_truth.hpp"

#include <cerrno>
#include <charconv>
#include <fstream>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "loopbit/error.hpp"

#include "text_rows.hpp"

namespace loopbit {
namespace {

/// The frame numbers that begin `text`, separated by commas.
std::vector<int> parse_frames(std::string_view text, std::size_t most) {
  std::vector<int> frames;
  while (frames.size() < most) {
    const auto comma = text.find(',');
    const std::string_view cell = datasets::trimmed(text.substr(0, comma));
    int frame = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), frame);
    if (error != std::errc() || end != cell.data() + cell.size() || frame < 0) break;
    frames.push_back(frame);
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  return frames;
}

}  // namespace

std::vector<PlaceRun> read_place_runs(const std::string& path) {
  std::vector<PlaceRun> runs;
  for (const auto& row : datasets::read_rows(path)) {
    const std::vector<int> frames = parse_frames(row.text, 4);
    if (frames.size() != 3 || frames[1] > frames[2]) {
      datasets::throw_bad_row(path, row, "query,first,last: three frame numbers, first <= last");
    }
    runs.push_back({frames[0], frames[1], frames[2]});
  }
  return runs;
}

std::vector<int> read_frame_list(const std::string& path) {
  std::vector<int> list;
  for (const auto& row : datasets::read_rows(path)) {
    const std::vector<int> frames = parse_frames(row.text, 1);
    if (frames.empty()) datasets::throw_bad_row(path, row, "a frame number, then perhaps a remark");
    list.push_back(frames.front());
  }
  return list;
}

void write_place_runs(const std::string& path, const std::string& comment,
                      const std::vector<PlaceRun>& runs) {
  std::ofstream file(path);
  fmt::print(file, "# {}\n", comment);
  for (const PlaceRun& run : runs) fmt::print(file, "{},{},{}\n", run.query, run.first, run.last);
  file.close();
  if (!file) throw cannot_write(path, errno);
}

}  // namespace loopbit
