// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/recorded_run.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/picture_jpeg.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

/// Sets `seconds` to the time that has passed, when it goes out of scope.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() {
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  Stopwatch(Stopwatch&&) = delete;
  Stopwatch& operator=(Stopwatch&&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Null if `record` names no map; else record.map_session is set.
std::shared_ptr<MapWriter> open_map(RunRecord& record, const RunOutput& out) {
  if (record.map_path.empty()) return nullptr;
  auto map =
      std::make_shared<MapWriter>(record.map_path, record.options, record.input,
                                  out.keep_images ? picture_jpeg : EncodeImage{}, out.map_cache_mb);
  record.map_session = map->session();
  return map;
}

std::string folder_of(const RunRecord& record, const std::string& out) {
  if (!out.empty()) return out;
  if (record.map_path.empty()) {
    throw Error(ErrorKind::option, "The run has no output; give a folder or a map.");
  }
  const auto stem = std::filesystem::path(record.map_path).replace_extension().string();
  return fmt::format("{}_session_{}", stem, record.map_session);
}

bool are_unreadable(const std::vector<Detection>& detections) {
  return std::all_of(detections.begin(), detections.end(),
                     [](const Detection& d) { return d.status == Status::unreadable; });
}

/// Whether a run ended in `folder` before any frame was answered.
bool is_unanswered(const std::string& folder) {
  const auto loops = std::filesystem::path(folder) / kLoopsFile;
  if (!is_there(loops)) return false;
  try {
    return are_unreadable(read_detections(loops.string()));
  } catch (const Error&) {  // no run of ours
    return false;
  }
}

/// The folder of a session is beside the map. One that is there already is of a session the map
/// does not have.
bool may_replace(const std::string& folder, const RunOutput& out) {
  return out.overwrite || (out.folder.empty() && is_unanswered(folder));
}

RunFolder make_folder(const RunRecord& record, const RunOutput& out) {
  const std::string folder = folder_of(record, out.folder);
  return {folder, may_replace(folder, out), out.inputs};
}

}  // namespace

RecordedRun::RecordedRun(RunRecord record, const RunOutput& out)
    : record_(std::move(record)),
      map_(open_map(record_, out)),
      detector_(std::in_place, record_.options, map_),
      folder_(make_folder(record_, out)) {
  record_.stopped_by = kRunning;
  folder_.write_record(record_);
}

void RecordedRun::detect(ImageSource& source, const RunListener& listener, bool keep_evidence,
                         const std::atomic<bool>& stop) {
  const Stopwatch stopwatch(record_.wall_s);
  // Of this call's own, so that an error closes the map, too.
  const std::shared_ptr<MapWriter> map = std::move(map_);
  LoopDetector detector = std::move(*detector_);
  RunListener recording{.on_detection =
                            [&](const Detection& detection) {
                              folder_.add(detection);
                              listener.on_detection(detection);
                            },
                        .on_bad_frame = listener.on_bad_frame};
  std::optional<EvidenceWriter> evidence;
  if (keep_evidence) {
    evidence.emplace(folder_.evidence_path());
    recording.on_evidence = [&](const Detection& detection, const cv::Mat& image,
                                const Evidence& seen) {
      evidence->add(detection.frame, image, seen);
    };
  }
  run(source, detector, recording, stop);
  record_.early_end = source.early_end();
  if (map) map_damage_ = map->damage();
  if (evidence) evidence->finish();
  if (map) map->finish();
  const std::vector<Detection>& detections = folder_.detections();
  if (!stop && are_unreadable(detections)) {
    throw Error(ErrorKind::input, fmt::format("None of the {} frames of '{}' could be read; the "
                                              "messages about them say why.",
                                              detections.size(), record_.input));
  }
}

void RecordedRun::keep_positions(const std::vector<std::optional<cv::Vec3d>>& positions_m) {
  folder_.write_positions(positions_m);
}

void RecordedRun::score(const GroundTruth& truth, const EvaluationOptions& options) {
  record_.score = evaluate(match_list(folder_.detections()), truth, options);
  record_.truth_every = truth.every;
  folder_.write_record(record_);  // the files of the truth are read by it
  folder_.write_truth(truth);
}

void RecordedRun::finish(const std::string& stopped_by) {
  record_.stopped_by = stopped_by;
  folder_.write_record(record_);
}

}  // namespace loopbit
