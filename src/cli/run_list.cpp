// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "run_list.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/error.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

bool is_folder(const std::string& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::pair<std::string, std::string> name_and_path(const std::string& text) {
  const auto equals = text.find('=');
  std::error_code error;
  if (equals != std::string::npos && !fs::exists(text, error)) {
    return {text.substr(0, equals), text.substr(equals + 1)};
  }
  const fs::path path = fs::path(text).lexically_normal();
  const fs::path last = path.has_filename() ? path : path.parent_path();
  return {is_folder(text) ? last.filename().string() : last.stem().string(), text};
}

/// How the run in a folder was scored when it ended.
void take_scoring(const nlohmann::json& record, ReportRun& run) {
  const auto score = record.find("score");
  if (score == record.end()) return;
  run.evaluation.tolerance_frames = score->value("tolerance_frames", 0);
  if (score->contains("protocol") && (*score)["protocol"].is_string()) {
    run.evaluation.protocol = (*score)["protocol"];
  }
}

}  // namespace

ReportRun report_run(const std::string& text, const TruthFlags& flags) {
  const auto [name, path] = name_and_path(text);
  ReportRun run;
  run.name = name;
  int every = 1;
  if (is_folder(path)) {
    run.run = read_run(path);
    run.list = match_list(run.run->detections);
    run.truth = run.run->truth;
    run.positions_m = run.run->positions_m;
    const auto record = nlohmann::json::parse(run.run->record_json, nullptr, false);
    if (record.is_object()) {
      take_scoring(record, run);
      if (const auto input = record.find("input"); input != record.end()) {
        every = input->value("every", 1);
      }
    }
  } else {
    run.list = read_match_list(path);
  }
  if (auto positions = flags.read_positions(run.list.times_s, every); !positions.empty()) {
    run.positions_m = std::move(positions);
  }
  if (flags.given()) {
    run.truth = flags.read_truth(run.list.times_s, every);
    run.evaluation = flags.evaluation();
  }
  return run;
}

ReportRun scored_run(const std::string& text, const TruthFlags& flags) {
  ReportRun run = report_run(text, flags);
  if (!run.truth) {
    throw Error(ErrorKind::option,
                fmt::format("'{}' says nothing about what is true; add --truth FILE.", text));
  }
  return run;
}

}  // namespace loopbit::cli
