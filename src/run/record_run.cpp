// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/record_run.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "loopbit/finished_run.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/picture_jpeg.hpp"
#include "loopbit/printable.hpp"

#include "depth_folder.hpp"
#include "evidence_writer.hpp"
#include "odometry_file.hpp"
#include "pose_file.hpp"
#include "run_files.hpp"
#include "run_folder.hpp"
#include "run_graph.hpp"

namespace loopbit {
namespace {

/// Sets `seconds` to the time that has passed, when it goes out of scope.
class WallClock {
 public:
  explicit WallClock(double& seconds) : seconds_(seconds) {}
  ~WallClock() {
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  WallClock(const WallClock&) = delete;
  WallClock& operator=(const WallClock&) = delete;
  WallClock(WallClock&&) = delete;
  WallClock& operator=(WallClock&&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What is known of the frames before they are read: their number, if that is sure.
FramesRead expected_frames(const RunInput& input) {
  const auto size = exact_size(input, input.input());
  return {.every = input.sampling().every,
          .times_s = FrameTimes(size.value_or(input.taken()) - input.taken()),
          .all = size && input.sampling().limit == 0};
}

/// Throws Error (kind option) if a file that counts from the first frame cannot be used.
void check_from_start(const RunInput& input, const RunRequest& request) {
  if (input.taken() == 0) return;
  const ScoringRequest& scoring = request.scoring;
  for (const std::string& file :
       {scoring.truth, scoring.not_false, scoring.ignore, request.poses, request.odometry}) {
    if (file.empty()) continue;
    throw Error(ErrorKind::option,
                fmt::format("'{}' counts from the first frame, with {} of '{}' already read; open "
                            "it again.",
                            file, counted(input.taken(), "frame"), input.input()));
  }
}

void check_positions(const std::optional<Positions>& positions_m, std::size_t frames) {
  if (!positions_m || positions_m->size() == frames) return;
  throw Error(ErrorKind::option,
              fmt::format("positions_m has {} rows, but there are {} frames; give one row per "
                          "frame that is read.",
                          positions_m->size(), frames));
}

/// Throws Error for what can be told before the frames are read.
void check(const RunRequest& request, const RunInput& input, const FramesRead& frames) {
  if (request.folder.empty() && request.map.empty()) {
    throw Error(ErrorKind::option, "The run has no output; give a folder or a map.");
  }
  if (request.keep_images && request.map.empty()) {
    throw Error(ErrorKind::option,
                "keep_images stores images in a map; give map, or leave it out.");
  }
  check_from_start(input, request);
  request.scoring.check(frames);
  if (!frames.times_s.empty()) check_positions(request.positions_m, frames.times_s.size());
  FramesRead at_least = frames;
  at_least.all = false;  // a trajectory may be longer
  if (!request.poses.empty()) check_poses(request.poses, at_least);
}

RunRecord record_of(const RunInput& input, const RunRequest& request) {
  const std::string truth = request.scoring.description();
  std::vector<std::string> arguments = request.arguments;
  std::transform(arguments.begin(), arguments.end(), arguments.begin(), without_secrets);
  return {.input = input.input(),
          .description = input.description(),
          .options = request.options,
          .sampling = input.sampling(),
          .threads = request.threads,
          .map_path = without_secrets(request.map),
          .stopped_by = kRunning,
          .arguments = arguments,
          .camera = request.camera ? request.camera_file : "",
          .odometry = request.odometry,
          .truth = truth.empty() ? request.truth_description : truth};
}

/// With the size of the images if the calibration has none. Throws Error (kind input) if it does
/// not fit the first usable image.
std::optional<CameraModel> camera_of(RunInput& input, const RunRequest& request) {
  std::optional<CameraModel> camera = request.camera;
  if (!camera) return std::nullopt;
  const cv::Size size_px = input.prove().image.size();
  check_size(*camera, fmt::format("'{}'", request.camera_file), size_px);
  camera->size_px = size_px;
  return camera;
}

/// Throws Error (kind input) if the mask cannot be read or does not fit the first usable image.
cv::Mat1b mask_of(RunInput& input, const RunRequest& request) {
  if (request.mask.empty()) return {};
  cv::Mat1b mask = read_mask(request.mask);
  const cv::Size size_px = input.prove().image.size();
  if (mask.size() == size_px) return mask;
  throw Error(ErrorKind::input,
              fmt::format("The mask '{}' has {} x {} px, but the images have {} x {}; give a mask "
                          "of the same size.",
                          request.mask, mask.cols, mask.rows, size_px.width, size_px.height));
}

/// What a run reads beside its images, checked against the first of them.
struct Inputs {
  cv::Mat1b mask;
  std::optional<CameraModel> camera;
  LengthSources lengths;
  std::optional<OdometryFile> odometry;
};

LoopDetector make_detector(const RunRequest& request, std::shared_ptr<MapStorage> map,
                           const Inputs& inputs) {
  LoopDetector detector(request.options, std::move(map));
  detector.set_mask(inputs.mask);
  // Through other lenses it finds no more than without, and takes longer.
  if (inputs.camera && inputs.camera->lens == Lens::equidistant) detector.set_camera(inputs.camera);
  return detector;
}

/// Throws Error if they do not fit the camera, or there is none.
LengthSources lengths_of(const RunRequest& request, const std::optional<CameraModel>& camera) {
  LengthSources lengths;
  const std::string& asked = request.depth.empty() ? request.right : request.depth;
  if (asked.empty()) return lengths;
  if (!camera) {
    throw Error(ErrorKind::option,
                fmt::format("The {} images of '{}' need the calibration of the camera; give it, "
                            "or leave them out.",
                            request.depth.empty() ? "right" : "depth", asked));
  }
  if (!request.depth.empty() && !request.right.empty()) {
    throw Error(ErrorKind::option,
                fmt::format("Both depth '{}' and right images '{}' are given; leave one out.",
                            request.depth, request.right));
  }
  if (request.depth.empty()) {
    lengths.right.emplace(
        request.right,
        right_camera(request.right, request.baseline_m, *camera, request.camera_file),
        request.options.surf);
    return lengths;
  }
  lengths.depth.emplace(request.depth, request.depth_scale);
  lengths.depth->check(camera->size_px);
  return lengths;
}

/// None without a file.
std::optional<OdometryFile> odometry_of(RunInput& input, const RunRequest& request,
                                        const FramesRead& frames) {
  if (request.odometry.empty()) return std::nullopt;
  return OdometryFile(request.odometry, frames, input.prove());
}

/// Null without a map.
std::shared_ptr<MapWriter> open_map(const RunInput& input, const RunRequest& request) {
  if (request.map.empty()) return nullptr;
  return std::make_shared<MapWriter>(request.map, request.options, input.input(),
                                     request.keep_images ? picture_jpeg : EncodeImage{},
                                     request.map_cache_mb);
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

/// A folder that is named after a session of the map may be replaced if it is of a session that the
/// map does not have.
RunFolder make_folder(const RunInput& input, const RunRequest& request, int map_session) {
  std::vector<std::string> inputs = request.other_inputs;
  const ScoringRequest& scoring = request.scoring;
  inputs.insert(inputs.end(), {input.input(), scoring.truth, scoring.not_false, scoring.ignore,
                               request.poses, request.mask, request.camera_file, request.odometry});
  if (!request.folder.empty()) return {request.folder, request.overwrite, inputs};
  const std::string folder = fmt::format("{}_session_{}", map_stem(request.map), map_session);
  return {folder, request.overwrite || is_unanswered(folder), inputs};
}

/// A run, from its folder to its end.
class RecordedRun {
 public:
  RecordedRun(RunInput& input, const RunRequest& request, FramesRead expected, Inputs inputs)
      : input_(input),
        request_(request),
        camera_(inputs.camera),
        lengths_(std::move(inputs.lengths)),
        odometry_(std::move(inputs.odometry)),
        frames_(std::move(expected)),
        map_(open_map(input, request)),
        detector_(make_detector(request, map_, inputs)),
        record_(record_of(input, request)),
        folder_(make_folder(input, request, map_ ? map_->session() : 0)) {
    if (map_) {
      record_.map_session = map_->session();
      map_->set_queue((std::filesystem::path(folder_.path()) / kQueueFile).string());
      record_.map_queue = map_->queue();
    }
    folder_.write_record(record_);
  }

  void detect(const RunListener& listener, const std::atomic<bool>& stop) {
    const WallClock clock(record_.wall_s);
    LoopDetector detector = std::move(*detector_);
    std::optional<PoseFile> poses;
    if (camera_) poses.emplace(folder_.path(), *camera_, std::move(lengths_));
    RunListener recording{.on_detection =
                              [&](const Detection& detection) {
                                folder_.add(detection);
                                if (poses) {
                                  save(poses->add(detection, detector));
                                }
                                listener.on_detection(detection);
                                tell_notices(listener);
                              },
                          .on_bad_frame = listener.on_bad_frame};
    std::optional<EvidenceWriter> evidence;
    if (request_.evidence) {
      evidence.emplace(folder_.evidence_path());
      recording.on_evidence = [&](const Detection& detection, const cv::Mat& image,
                                  const Evidence& seen) {
        const StoredEvidence stored = evidence->add(detection.frame, image, seen);
        if (listener.on_stored) listener.on_stored(detection, stored);
      };
    }
    if (listener.on_start) listener.on_start(folder_.path());
    FrameOdometry odometry;
    if (odometry_) odometry = [&](const Frame& frame) { return odometry_->next(frame); };
    run(input_, detector, recording, stop, odometry, request_.threads);
    record_.early_end = input_.early_end();
    if (map_) map_damage_ = map_->damage();
    if (poses) poses_ = poses->poses();
    if (evidence) evidence->finish();
    if (!stop && are_unreadable(folder_.detections())) {
      throw Error(ErrorKind::input,
                  fmt::format("No frame of '{}' could be read; the messages about "
                              "them say why.",
                              input_.input()));
    }
  }

  /// Corrects the trajectory, if asked to. Loops that the graph rejects are withdrawn, in the map,
  /// too.
  void correct(const RunListener& listener) {
    attempt([&] {
      if (odometry_) odometry_->check_used();
    });
    if (!request_.correct) return;
    attempt([&] {
      graph_.emplace(folder_.detections(), poses_, request_.options.odometry);
      const std::vector<LateLoop> rejected = graph_->rejected();
      folder_.withdraw(rejected);
      if (listener.on_rejected && !rejected.empty()) listener.on_rejected(rejected);
      graph_->write(folder_.path());
      for (const LateLoop& loop : rejected) {
        if (map_) map_->reject({0, loop.frame}, {0, loop.match.value_or(0)});
      }
    });
  }

  void close_map(const RunListener& listener, const std::atomic<bool>& stop) {
    if (!map_) return;
    map_->finish_unless([&] { return stop.load(); });
    tell_notices(listener);
    record_.map_reconnections = map_->reconnections();
    record_.map_unverified = map_->unverified();
    record_.map_not_asked = map_->not_asked();
    record_.map_queue = map_->queue();
    if (record_.map_queue.empty()) return;
    record_.map_queued_frames =
        static_cast<std::int64_t>(folder_.detections().size()) - map_->saved_frames();
  }

  /// Scores the detections, and stores truth and positions. `is_cut_off`: by a stop.
  void score(bool is_cut_off) {
    const std::size_t expected = frames_.times_s.size();
    frames_.times_s = match_list(folder_.detections()).times_s;
    frames_.all = frames_.all && frames_.times_s.size() == expected;
    attempt([&] { write_score(); });
    attempt([&] { write_positions(is_cut_off); });
    if (graph_) record_.correction = graph_->results(positions_m_);
  }

  /// Writes the final run.json.
  void finish(const std::string& stopped_by) {
    record_.stopped_by = stopped_by;
    folder_.write_record(record_);
  }

  RunOutcome outcome() && {
    return {folder_.path(), std::move(record_), folder_.detections(), std::move(map_damage_),
            std::move(fault_)};
  }

 private:
  /// Only the first fault is told.
  template <typename Step>
  void attempt(const Step& step) {
    try {
      step();
    } catch (const Error& error) {
      if (!fault_) fault_ = error;
    }
  }

  /// Of the map's server.
  void tell_notices(const RunListener& listener) {
    if (!map_ || !listener.on_notice) return;
    for (const std::string& notice : map_->take_notices()) listener.on_notice(notice);
  }

  /// In the map, if there is one.
  void save(std::span<const LoopPose> poses) {
    if (!map_) return;
    for (const LoopPose& loop : poses) {
      map_->add_pose({.query = {0, loop.query},
                      .match = loop.earlier_match.value_or(SessionFrame{0, loop.match.value_or(0)}),
                      .measured = known_motion(loop.pose)});
    }
  }

  void write_score() {
    const auto [truth, evaluation] = request_.scoring.resolve(frames_, {.truth = request_.truth});
    if (!truth) return;
    record_.score = evaluate(match_list(folder_.detections()), *truth, evaluation);
    record_.truth_every = truth->every;
    folder_.write_record(record_);  // the files of the truth are read by it
    folder_.write_truth(*truth);
  }

  void write_positions(bool is_cut_off) {
    std::optional<Positions> positions_m = request_.positions_m;
    if (is_cut_off && positions_m) positions_m->resize(frames_.times_s.size());
    check_positions(positions_m, frames_.times_s.size());
    const std::string file = request_.scoring.poses_file(request_.poses);
    if (!positions_m && !file.empty()) positions_m = read_positions(file, frames_);
    if (!positions_m) return;
    folder_.write_positions(*positions_m);
    positions_m_ = std::move(*positions_m);
  }

  RunInput& input_;
  const RunRequest& request_;
  std::optional<CameraModel> camera_;
  LengthSources lengths_;  ///< until detect()
  std::optional<OdometryFile> odometry_;
  FramesRead frames_;               ///< expected, then read
  std::shared_ptr<MapWriter> map_;  ///< null without one
  std::optional<LoopDetector> detector_;
  RunRecord record_;
  RunFolder folder_;
  std::vector<LoopPose> poses_;    ///< after detect()
  std::optional<RunGraph> graph_;  ///< after correct(); none without
  Positions positions_m_;          ///< after score(); empty if none are known
  std::vector<std::string> map_damage_;
  std::optional<Error> fault_;
};

}  // namespace

cv::Mat1b read_mask(const std::string& file) {
  const cv::Mat image = images::read_image_file(file, kMaxMegapixels);
  if (image.depth() != CV_8U) {
    throw Error(ErrorKind::input,
                fmt::format("The mask '{}' has 16 bits per pixel; convert it to 8 bits.", file));
  }
  cv::Mat1b mask = gray_image(image);
  if (cv::countNonZero(mask) > 0) return mask;
  throw Error(ErrorKind::input,
              fmt::format("The mask '{}' is black everywhere, which excludes the whole image; "
                          "pixels that count are not black.",
                          file));
}

RunOutcome record_run(RunInput& input, const RunRequest& request, const RunListener& listener,
                      const std::atomic<bool>& stop) {
  const FramesRead expected = expected_frames(input);
  check(request, input, expected);
  if (request.overwrite || request.options.exclusion.seconds > 0) {
    check_time(input.prove(), request.options);
  }
  Inputs inputs;
  inputs.mask = mask_of(input, request);
  inputs.camera = camera_of(input, request);
  inputs.lengths = lengths_of(request, inputs.camera);
  inputs.odometry = odometry_of(input, request, expected);
  RecordedRun run(input, request, expected, std::move(inputs));
  try {
    run.detect(listener, stop);
    run.correct(listener);
    run.close_map(listener, stop);
  } catch (const std::exception& error) {
    try {
      run.finish(error.what());
    } catch (const Error&) {  // the first error is the one to tell
    }
    throw;
  }
  run.score(stop);
  run.finish(stop ? "interrupt" : "end");
  return std::move(run).outcome();
}

}  // namespace loopbit
