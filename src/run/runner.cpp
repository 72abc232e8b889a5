// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/runner.hpp"

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {

void check_time(const Frame& frame, const LoopDetectorOptions& options) {
  const double seconds = options.exclusion.seconds;
  if (seconds <= 0 || frame.timestamp_s) return;
  throw Error(ErrorKind::option,
              fmt::format("exclusion.seconds is {}, but '{}' has no time; give the times of the "
                          "images, or set exclusion.frames in its place.",
                          seconds, frame.name));
}

void run(ImageSource& source, LoopDetector& detector, const RunListener& listener,
         const std::atomic<bool>& stop, const FrameOdometry& odometry) {
  bool is_first = true;
  const auto report = [&](Detection detection, const Frame& frame) {
    detection.name = frame.name;
    listener.on_detection(detection);
  };
  std::optional<OdometryPose> pose;  // of the present frame
  const auto leave_out = [&](const Frame& frame, const std::string& reason) {
    listener.on_bad_frame(fmt::format("Frame {}: {}", detector.size(), reason));
    report(detector.skip(frame.timestamp_s, pose), frame);
  };
  const auto detect = [&](const Frame& frame) {
    if (odometry) {
      pose = odometry(frame);
    } else if (frame.T_odometry_camera) {
      pose = OdometryPose{*frame.T_odometry_camera, frame.odometry_covariance};
    } else {
      pose.reset();
    }
    if (!frame.error.empty()) return leave_out(frame, frame.error);
    if (is_first) check_time(frame, detector.options());
    Evidence evidence;
    Detection detection;
    try {
      detection = detector.process(frame.image, frame.timestamp_s, pose,
                                   listener.on_evidence ? &evidence : nullptr);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input) throw;
      return leave_out(frame, fmt::format("'{}': {}", frame.name, error.what()));
    }
    is_first = false;
    report(detection, frame);
    if (listener.on_evidence) listener.on_evidence(detection, frame.image, evidence);
  };
  for (Frame frame; !stop && source.next(frame);) detect(frame);
}

}  // namespace loopbit
