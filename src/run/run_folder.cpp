// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "run_folder.hpp"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/write_file.hpp"

#include "earlier_run.hpp"
#include "run_files.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

/// A name that needs no quotes: commas, quotes and control characters become "\x2c" and the like.
std::string name_cell(const std::string& name) {
  std::string cell;
  for (const char c : printable(name)) {
    if (c == ',' || c == '"') {
      cell += c == ',' ? "\\x2c" : "\\x22";
    } else {
      cell += c;
    }
  }
  return cell;
}

std::string terms_cells(const std::optional<ScoreTerms>& terms) {
  if (!terms) return ",,,,";
  return fmt::format("{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}", terms->votes, terms->geometry,
                     terms->path, terms->rivals, terms->prior);
}

/// `before`: the detections of the frames before it.
std::string csv_row(const Detection& d, const std::vector<Detection>& before) {
  const StepTimes& t = d.times;
  const auto match = static_cast<std::size_t>(d.match.value_or(d.frame));
  const std::string match_name = match < before.size() ? before[match].name : "";
  return fmt::format("{},{},{},{},{},{:.6f},{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f}\n", d.frame,
                     d.timestamp_s ? fmt::format("{:.6f}", *d.timestamp_s) : "",
                     to_string(d.status), match_cell(d), d.score, d.similarity, d.matches,
                     d.inliers, terms_cells(d.terms), name_cell(d.name), name_cell(match_name),
                     t.content_ms, t.retrieval_ms, t.features_ms, t.verification_ms);
}

/// Rows of late_loops.csv. `detections`: all until the frame that reports them.
std::string late_rows(const std::vector<LateLoop>& loops, const char* kind,
                      const std::vector<Detection>& detections) {
  std::string text;
  for (const LateLoop& loop : loops) {
    const auto name_of = [&](std::optional<PlaceId> frame) {
      return frame ? name_cell(detections.at(static_cast<std::size_t>(*frame)).name) : "";
    };
    text += fmt::format("{},{},{},{},{:.6f},{},{},{}\n", loop.frame, kind, match_cell(loop),
                        loop.score, loop.similarity, detections.back().frame, name_of(loop.frame),
                        name_of(loop.match));
  }
  return text;
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

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

double peak_memory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr double kKibPerMib = 1024.0;
  return static_cast<double>(usage.ru_maxrss) / kKibPerMib;
}

Machine this_machine() {
  utsname system{};
  uname(&system);
  return {.processor = processor_name(),
          .cores = static_cast<int>(std::thread::hardware_concurrency()),
          .kernel = std::string(to_string(active_instruction_set())),
          .system = fmt::format("{} {} {}", system.sysname, system.release, system.machine)};
}

/// Peak memory is that of this process.
RunResults run_results(const std::vector<Detection>& detections, double wall_s) {
  RunResults results{.frames = static_cast<int>(detections.size()),
                     .content_ms = summarize(detections, &StepTimes::content_ms),
                     .retrieval_ms = summarize(detections, &StepTimes::retrieval_ms),
                     .features_ms = summarize(detections, &StepTimes::features_ms),
                     .verification_ms = summarize(detections, &StepTimes::verification_ms),
                     .total_ms = summarize(detections, loopbit::total_ms),
                     .peak_memory_mib = peak_memory_mib()};
  for (const Detection& d : detections) {
    ++results.by_status[static_cast<std::size_t>(d.status)];
    results.late_loops += static_cast<int>(d.late_loops.size());
    results.withdrawn_loops += static_cast<int>(d.withdrawn_loops.size());
  }
  if (wall_s > 0) results.frames_per_s = static_cast<double>(detections.size()) / wall_s;
  return results;
}

}  // namespace

std::string match_cell(const Detection& detection) {
  return match_cell(LateLoop{.match = detection.match, .earlier_match = detection.earlier_match});
}

std::string match_cell(const LateLoop& loop) {
  if (loop.earlier_match) {
    return fmt::format("{}:{}", loop.earlier_match->session, loop.earlier_match->frame);
  }
  return loop.match ? fmt::format("{}", *loop.match) : "";
}

/// A CSV file of whole rows.
class RunFolder::Rows {
 public:
  Rows(const std::string& folder, const char* name, const char* header)
      : path_((fs::path(folder) / name).string()), file_(std::fopen(path_.c_str(), "wx")) {
    if (!file_) throw cannot_write(path_, errno);
    std::setvbuf(file_.get(), nullptr, _IONBF, 0);
    append(fmt::format("{}\n", header), 0);
  }

  /// `rows_before`: for the error.
  void append(const std::string& rows, std::size_t rows_before) {
    if (std::fwrite(rows.data(), 1, rows.size(), file_.get()) == rows.size()) {
      bytes_ += static_cast<std::int64_t>(rows.size());
      return;
    }
    const int reason = errno;
    // What went to disk of a row that did not fit would be taken for a whole one.
    const bool cut = ftruncate(fileno(file_.get()), bytes_) == 0;
    throw cannot_write(path_, reason,
                       cut ? fmt::format(" The {} rows before are kept.", rows_before)
                           : " Its last row is incomplete.");
  }

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;  ///< unbuffered
  std::int64_t bytes_ = 0;                      ///< of whole rows
};

RunFolder::RunFolder(const std::string& path, bool overwrite,
                     const std::vector<std::string>& inputs)
    : path_(path),
      earlier_(std::make_unique<EarlierRun>(path, overwrite, inputs)),
      loops_(std::make_unique<Rows>(path, kLoopsFile, kLoopsHeader)),
      late_loops_(std::make_unique<Rows>(path, kLateLoopsFile, kLateLoopsHeader)) {}

/// A row of epochs.csv, if the answer is as of another epoch than the one before.
void RunFolder::add_epoch(const Detection& detection) {
  const std::int64_t before = detections_.empty() ? 0 : detections_.back().epoch;
  if (detection.epoch == before) return;
  if (!epochs_) epochs_ = std::make_unique<Rows>(path_, kEpochsFile, kEpochsHeader);
  epochs_->append(fmt::format("{},{}\n", detection.frame, detection.epoch), detections_.size());
}

void RunFolder::add(const Detection& detection) {
  add_epoch(detection);
  loops_->append(csv_row(detection, detections_), detections_.size());
  detections_.push_back(detection);
  earlier_->leave_aside();
  const std::string late = late_rows(detection.withdrawn_loops, kWithdrawn, detections_) +
                           late_rows(detection.late_loops, kLate, detections_);
  if (!late.empty()) late_loops_->append(late, late_rows_);
  late_rows_ += detection.late_loops.size() + detection.withdrawn_loops.size();
}

void RunFolder::withdraw(const std::vector<LateLoop>& loops) {
  if (loops.empty()) return;
  late_loops_->append(late_rows(loops, kWithdrawn, detections_), late_rows_);
  late_rows_ += loops.size();
  auto& withdrawn = detections_.back().withdrawn_loops;
  withdrawn.insert(withdrawn.end(), loops.begin(), loops.end());
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

void RunFolder::write_record(const RunRecord& record) {
  RunRecord whole = record;
  whole.machine = this_machine();
  if (record.stopped_by != kRunning) {
    whole.results = run_results(detections_, record.wall_s);
    whole.odometry_doubt = odometry_doubt(detections_, record.correction);
  }
  std::string text = to_json(whole) + '\n';
  if (record.stopped_by == kRunning) text.append(kRoomForTheEnd - 1, ' ').push_back('\n');
  const fs::path file = fs::path(path_) / kRecordFile;
  try {
    write_file(file.string(), text);
  } catch (const Error&) {
    if (!write_in_place(file, text)) throw;
  }
  if (record.has_ended() && !detections_.empty()) earlier_->remove();
}

RunFolder::~RunFolder() = default;

}  // namespace loopbit
