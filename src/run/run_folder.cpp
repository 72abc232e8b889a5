// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/run_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "loopbit/database.hpp"
#include "loopbit/error.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/version.hpp"
#include "loopbit/write_file.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// All that a run may leave; a run that replaces another may not leave its files beside its own.
/// Last those that tell a run from a data set, so that a run half removed is still one.
std::vector<std::string> files_of_a_run() {
  std::vector<std::string> names{kTruthFile,   kNotFalseFile,  kIgnoreFile,
                                 kUnknownFile, kPositionsFile, kReportFile};
  for (const char* suffix : kDatabaseSuffixes) {
    names.push_back(std::string(kEvidenceFile) + suffix);
  }
  names.insert(names.end(), {kRecordFile, kLoopsFile});
  return names;
}

/// Of the files of a run those that are in `folder`. Throws Error if one may not be replaced.
std::vector<fs::path> files_to_replace(const fs::path& folder, bool overwrite,
                                       const std::vector<std::string>& inputs) {
  std::vector<fs::path> files;
  for (const std::string& name : files_of_a_run()) {
    if (is_there(folder / name)) files.push_back(folder / name);
  }
  if (files.empty()) return files;
  const fs::path last = files.back().filename();
  if (last != kRecordFile && last != kLoopsFile) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' holds no earlier run, but a file {} that a run might replace; "
                            "name another folder.",
                            folder.string(), last.string()));
  }
  if (!overwrite) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' holds an earlier run ({}); name another folder, or add "
                            "--overwrite to replace it.",
                            folder.string(), last.string()));
  }
  for (const fs::path& file : files) {
    for (const std::string& input : inputs) {
      std::error_code error;
      if (!fs::equivalent(file, input, error)) continue;
      throw Error(ErrorKind::output,
                  fmt::format("'{}' is read by this run, which would replace it; name another "
                              "folder.",
                              input));
    }
  }
  return files;
}

void make_folder(const fs::path& folder, bool overwrite, const std::vector<std::string>& inputs) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw cannot_write(folder.string(), error.value());
  for (const fs::path& file : files_to_replace(folder, overwrite, inputs)) {
    if (!fs::remove(file, error)) throw cannot_write(file.string(), error.value());
  }
}

/// "17", or "2:17" for frame 17 of session 2 of the map.
std::string match_cell(const Detection& d) {
  if (d.earlier_match) {
    return fmt::format("{}:{}", d.earlier_match->session, d.earlier_match->frame);
  }
  return d.match ? fmt::format("{}", *d.match) : "";
}

std::string csv_row(const Detection& d) {
  const StepTimes& t = d.times;
  return fmt::format("{},{},{},{},{},{:.6f},{},{},{:.3f},{:.3f},{:.3f},{:.3f}\n", d.frame,
                     d.timestamp_s ? fmt::format("{:.6f}", *d.timestamp_s) : "",
                     to_string(d.status), match_cell(d), d.score, d.similarity, d.matches,
                     d.inliers, t.content_ms, t.retrieval_ms, t.features_ms, t.verification_ms);
}

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

Json machine() {
  utsname system{};
  uname(&system);
  return {{"processor", processor_name()},
          {"cores", std::thread::hardware_concurrency()},
          {"kernel", to_string(active_instruction_set())},
          {"system", fmt::format("{} {} {}", system.sysname, system.release, system.machine)}};
}

double peak_memory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr double kKibPerMib = 1024.0;
  return static_cast<double>(usage.ru_maxrss) / kKibPerMib;
}

Json counts(const std::vector<Detection>& detections) {
  Json by_status;
  for (const Status status : kAllStatuses) {
    by_status[std::string(to_string(status))] =
        std::count_if(detections.begin(), detections.end(),
                      [&](const Detection& d) { return d.status == status; });
  }
  return {{"frames", detections.size()}, {"by_status", by_status}};
}

Json to_json(const TimeSummary& times) {
  return {{"mean", times.mean}, {"p50", times.p50}, {"p99", times.p99}, {"max", times.max}};
}

Json times(const std::vector<Detection>& detections) {
  return {{"content", to_json(summarize(detections, &StepTimes::content_ms))},
          {"retrieval", to_json(summarize(detections, &StepTimes::retrieval_ms))},
          {"features", to_json(summarize(detections, &StepTimes::features_ms))},
          {"verification", to_json(summarize(detections, &StepTimes::verification_ms))},
          {"total", to_json(summarize(detections, total_ms))}};
}

void add_results(Json& json, const RunRecord& record, const std::vector<Detection>& detections) {
  json["counts"] = counts(detections);
  json["times_ms"] = times(detections);
  json["wall_s"] = record.wall_s;
  json["frames_per_s"] =
      record.wall_s > 0 ? static_cast<double>(detections.size()) / record.wall_s : 0.0;
  json["peak_memory_mib"] = peak_memory_mib();
  if (record.score) json["score"] = Json::parse(to_json(*record.score, false));
}

Json to_json(const RunRecord& record, const std::vector<Detection>& detections) {
  Json json{{"loopbit", kVersion},
            {"arguments", record.arguments},
            {"input",
             {{"path", record.input},
              {"description", record.description},
              {"every", record.every},
              {"limit", record.limit}}},
            {"stopped_by", record.stopped_by},
            {"options", Json::parse(loopbit::to_json(record.options))},
            {"machine", machine()},
            {"threads", record.threads}};
  if (!record.map_path.empty()) {
    json["map"] = {{"path", record.map_path}, {"session", record.map_session}};
  }
  if (record.views != 1) json["input"]["views"] = record.views;
  if (!record.truth.empty()) json["truth"] = record.truth;
  if (record.truth_every != 1) json["truth_every"] = record.truth_every;
  if (record.stopped_by != kRunning) add_results(json, record, detections);
  return json;
}

std::string frame_list(const char* comment, const std::vector<int>& frames) {
  std::string text = fmt::format("# {}\n", comment);
  for (const int frame : frames) text += fmt::format("{}\n", frame);
  return text;
}

}  // namespace

RunFolder::RunFolder(const std::string& path, bool overwrite,
                     const std::vector<std::string>& inputs)
    : path_(path) {
  make_folder(path, overwrite, inputs);
  const fs::path loops = fs::path(path) / kLoopsFile;
  loops_.reset(std::fopen(loops.c_str(), "wx"));
  if (!loops_) throw cannot_write(loops.string(), errno);
  std::setvbuf(loops_.get(), nullptr, _IONBF, 0);
  append(fmt::format("{}\n", kLoopsHeader));
}

void RunFolder::append(const std::string& row) {
  if (std::fwrite(row.data(), 1, row.size(), loops_.get()) == row.size()) {
    loops_bytes_ += static_cast<std::int64_t>(row.size());
    return;
  }
  const int reason = errno;
  // What went to disk of a row that did not fit would be taken for a whole one.
  const bool cut = ftruncate(fileno(loops_.get()), loops_bytes_) == 0;
  throw cannot_write((fs::path(path_) / kLoopsFile).string(), reason,
                     cut ? fmt::format(" The {} rows before are kept.", detections_.size())
                         : " Its last row is incomplete.");
}

void RunFolder::add(const Detection& detection) {
  append(csv_row(detection));
  detections_.push_back(detection);
}

void RunFolder::write_truth(const GroundTruth& truth) {
  const fs::path folder = path_;
  write_place_runs((folder / kNotFalseFile).string(),
                   "query, first and last earlier frame: a match here is not false",
                   truth.near_place);
  write_file((folder / kIgnoreFile).string(),
             frame_list("queries that are not scored", truth.ignored));
  write_file((folder / kUnknownFile).string(),
             frame_list("frames of which nobody knows what they show", truth.unknown));
  // Last: where it is, the others are.
  write_place_runs((folder / kTruthFile).string(), "query, first and last true earlier frame",
                   truth.same_place);
}

void RunFolder::write_positions(const std::vector<std::optional<cv::Vec3d>>& positions_m) {
  std::string text = fmt::format("{}\n", kPositionsHeader);
  for (std::size_t frame = 0; frame < positions_m.size(); ++frame) {
    if (!positions_m[frame]) continue;
    const cv::Vec3d& p = *positions_m[frame];
    text += fmt::format("{},{:.4f},{:.4f},{:.4f}\n", frame, p[0], p[1], p[2]);
  }
  write_file((fs::path(path_) / kPositionsFile).string(), text);
}

std::string RunFolder::evidence_path() const { return (fs::path(path_) / kEvidenceFile).string(); }
std::string RunFolder::report_path() const { return (fs::path(path_) / kReportFile).string(); }

void RunFolder::write_record(const RunRecord& record) {
  // A path need not be UTF-8, which JSON is.
  const std::string text =
      to_json(record, detections_).dump(2, ' ', false, Json::error_handler_t::replace);
  write_file((fs::path(path_) / kRecordFile).string(), text + '\n');
}

double total_ms(const StepTimes& times) {
  return times.content_ms + times.retrieval_ms + times.features_ms + times.verification_ms;
}

TimeSummary summarize(const std::vector<Detection>& detections,
                      const std::function<double(const StepTimes&)>& time_ms) {
  std::vector<double> times;
  for (const Detection& detection : detections) {
    if (detection.status != Status::unreadable) times.push_back(time_ms(detection.times));
  }
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  double sum = 0;
  for (const double time : times) sum += time;
  const auto quantile = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(times.size()));  // from 1
    return times[static_cast<std::size_t>(rank) - 1];
  };
  return {sum / static_cast<double>(times.size()), quantile(0.5), quantile(0.99), times.back()};
}

}  // namespace loopbit
