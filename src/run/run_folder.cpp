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

#include "loopbit/error.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/version.hpp"
#include "loopbit/write_file.hpp"

#include "earlier_run.hpp"
#include "run_files.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

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
  if (!record.early_end.empty()) json["input"]["early_end"] = record.early_end;
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

/// What run.json has to spare from the beginning, for how it ends.
constexpr std::size_t kRoomForTheEnd = 8192;

/// Writes `text` over what is in `file`, whose length stays, so that a full disk has room for it.
/// False if it is too long or cannot be written.
bool write_in_place(const fs::path& file, std::string text) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size < text.size()) return false;
  text.resize(size, ' ');
  text.back() = '\n';
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  return !stream.fail();
}

}  // namespace

RunFolder::RunFolder(const std::string& path, bool overwrite,
                     const std::vector<std::string>& inputs)
    : path_(path), earlier_(std::make_unique<EarlierRun>(path, overwrite, inputs)) {
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
  earlier_->leave_aside();
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
  std::string text =
      to_json(record, detections_).dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
  if (record.stopped_by == kRunning) text.append(kRoomForTheEnd - 1, ' ').push_back('\n');
  const fs::path file = fs::path(path_) / kRecordFile;
  try {
    write_file(file.string(), text);
  } catch (const Error&) {
    if (!write_in_place(file, text)) throw;
  }
  const bool has_ended = record.stopped_by == "end" || record.stopped_by == "interrupt";
  if (has_ended && !detections_.empty()) earlier_->remove();
}

RunFolder::~RunFolder() = default;

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
