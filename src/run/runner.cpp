// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/runner.hpp"

#include <cstddef>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/read_ahead.hpp"

namespace loopbit {
namespace {

/// So many frames wait for the detector where a thread of its own prepares them.
constexpr std::size_t kFramesPrepared = 2;

/// A frame and what it is recognised by.
struct PreparedFrame {
  Frame frame;
  PreparedImage image;
  std::exception_ptr fault;  ///< why there is no `image`, although the frame has no error
};

void prepare(const LoopDetector& detector, PreparedFrame& frame) {
  if (!frame.frame.error.empty()) return;
  try {
    frame.image = detector.prepare(frame.frame.image);
  } catch (...) {
    frame.fault = std::current_exception();
  }
}

}  // namespace

void check_time(const Frame& frame, const LoopDetectorOptions& options) {
  const double seconds = options.exclusion.seconds;
  if (seconds <= 0 || frame.timestamp_s) return;
  throw Error(ErrorKind::option,
              fmt::format("exclusion.seconds is {}, but '{}' has no time; give the times of the "
                          "images, or set exclusion.frames in its place.",
                          seconds, frame.name));
}

void run(ImageSource& source, LoopDetector& detector, const RunListener& listener,
         const std::atomic<bool>& stop, const FrameOdometry& odometry, int threads) {
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
  const auto detect = [&](PreparedFrame prepared) {
    const Frame& frame = prepared.frame;
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
      if (prepared.fault) std::rethrow_exception(prepared.fault);
      detection = detector.process(std::move(prepared.image), frame.timestamp_s, pose,
                                   listener.on_evidence ? &evidence : nullptr);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input) throw;
      return leave_out(frame, fmt::format("'{}': {}", frame.name, error.what()));
    }
    is_first = false;
    report(detection, frame);
    if (listener.on_evidence) listener.on_evidence(detection, frame.image, evidence);
  };
  const auto read = [&](PreparedFrame& prepared) {
    if (!source.next(prepared.frame)) return false;
    prepare(detector, prepared);
    return true;
  };
  const auto detect_all = [&](const auto& next) {
    for (PreparedFrame frame; !stop && next(frame); frame = {}) detect(std::move(frame));
  };
  if (threads <= 1) return detect_all(read);
  ReadAhead<PreparedFrame> ahead(read, kFramesPrepared);
  detect_all([&](PreparedFrame& frame) { return ahead.next(frame); });
}

}  // namespace loopbit
