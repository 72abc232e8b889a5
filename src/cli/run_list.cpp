// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "run_list.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

bool is_folder(const std::string& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

/// The folder of a run of which `path` is the list, or `path`.
std::string run_of(const std::string& path) {
  const fs::path list(path);
  const fs::path folder = list.has_parent_path() ? list.parent_path() : ".";
  std::error_code error;
  const bool is_of_run =
      list.filename() == "loops.csv" && fs::is_regular_file(folder / "run.json", error);
  return is_of_run ? folder.string() : path;
}

std::pair<std::string, std::string> name_and_path(const std::string& text) {
  const auto equals = text.find('=');
  std::error_code error;
  if (equals != std::string::npos && !fs::exists(text, error)) {
    return {text.substr(0, equals), run_of(text.substr(equals + 1))};
  }
  const std::string run = run_of(text);
  const fs::path path = fs::path(run).lexically_normal();
  const fs::path last = path.has_filename() ? path : path.parent_path();
  return {is_folder(run) ? last.filename().string() : last.stem().string(), run};
}

}  // namespace

ListedRun listed_run(const std::string& text) {
  const auto [name, path] = name_and_path(text);
  ListedRun listed;
  if (is_folder(path)) {
    listed.run = to_report_run(name, read_run(path));
    listed.frames = listed.run.run->frames();
  } else {
    listed.run.name = name;
    listed.run.list = read_match_list(path);
    listed.frames.times_s = listed.run.list.times_s;
  }
  return listed;
}

void take_truth(ReportRun& run, const TruthFlags& flags, const FramesRead& frames) {
  if (auto positions = flags.read_positions(frames); !positions.empty()) {
    run.positions_m = std::move(positions);
  }
  auto [truth, evaluation] = flags.scoring.resolve(frames, {run.truth, run.evaluation});
  run.truth = std::move(truth);
  run.evaluation = std::move(evaluation);
}

ReportRun report_run(const std::string& text, const TruthFlags& flags) {
  ListedRun listed = listed_run(text);
  take_truth(listed.run, flags, listed.frames);
  return std::move(listed.run);
}

std::string report_in(const std::string& folder) {
  return (fs::path(folder) / "report.html").string();
}

ReportRun scored_run(const std::string& text, const TruthFlags& flags) {
  ReportRun run = report_run(text, flags);
  if (!run.truth) {
    throw Error(ErrorKind::option,
                fmt::format("'{}' has no ground truth; add --truth FILE.", text));
  }
  return run;
}

}  // namespace loopbit::cli
