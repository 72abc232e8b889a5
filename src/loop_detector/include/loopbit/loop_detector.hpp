// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/camera.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/evidence.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_storage.hpp"

namespace loopbit {

/// The places that may be candidates of a frame, such as those near the position that odometry or
/// GPS gives: all of them, those for which a function returns true, or those of a list. All others
/// are ignored, as if they did not exist. A function is called only for places that would otherwise
/// matter. Session 0 is this session; listed places that do not exist are ignored.
using AllowedPlaces = std::variant<std::monostate, std::function<bool(const SessionFrame&)>,
                                   std::span<const SessionFrame>>;

/// An image and what it is recognised by, which depends on no other image: see
/// LoopDetector::prepare().
struct PreparedImage {
  cv::Mat image = {};          ///< as it was given, not a copy
  cv::Mat1f saliency = {};     ///< 64 x 64
  BinaryContent content = {};  ///< 512 bytes
  Features features = {};      ///< at most 50 KB by default
  StepTimes times = {};        ///< of these two steps
};

/// Tells for each camera image whether the camera has been here before.
///
/// H. Wang, J. Li, M. Ran, L. Xie, "Fast Loop Closure Detection via Binary Content", 2019. Binary
/// content finds similar earlier places, SURF features and epipolar geometry verify them, and a
/// Bayes filter over places gives the probability that the camera is back. The same images give the
/// same answers on any processor.
///
/// Several threads may call const functions at once, such as query(). Other functions need the
/// detector for themselves, so lock a std::shared_mutex: shared for query(), exclusive for
/// process(). Only prepare() needs no lock. A MapStorage is asked by one thread at a time.
///
/// Memory: at most 50 KB per place by default, nearly all of it features, plus working memory that
/// is reused for every frame, for each thread that queries at the same time. With a map, the map
/// stores the features, and 700 bytes per place remain.
class LoopDetector {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit LoopDetector(const LoopDetectorOptions& options = {});

  /// Continues `map` with a new session. All places of earlier sessions are candidates; the
  /// exclusion window does not apply to them. The map stores features and returns them when a
  /// candidate is verified. Throws Error (kind option) if `options` are not valid or the map was
  /// made with other settings of binary_content or surf, and whatever the map throws. Cost: a few
  /// microseconds per place in the map.
  LoopDetector(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map);
  ~LoopDetector();
  LoopDetector(const LoopDetector&) = delete;
  LoopDetector& operator=(const LoopDetector&) = delete;
  /// A moved-from detector may only be assigned to or destroyed.
  LoopDetector(LoopDetector&&) noexcept;
  LoopDetector& operator=(LoopDetector&&) noexcept;

  /// Detects, then adds the image as the next place.
  ///
  /// `image`: 8- or 16-bit, grey, BGR or BGRA, at least 32 x 32. `timestamp_s`: in seconds, not
  /// before the previous one; only needed if the exclusion window is given in seconds. `evidence`:
  /// if not null, receives the evidence for the answer.
  /// `allowed`: restricts the candidates of this frame. Throws Error (kind input) if the image or
  /// the time cannot be used, std::bad_alloc if there is no memory for another place, and whatever
  /// MapStorage::add throws. In each case the detector is unchanged.
  Detection process(const cv::Mat& image, std::optional<double> timestamp_s = std::nullopt,
                    Evidence* evidence = nullptr, const AllowedPlaces& allowed = {});

  /// The same with the odometry of this frame, if there is any. Throws Error (kind input) for a bad
  /// pose, too, see check_odometry().
  Detection process(const cv::Mat& image, std::optional<double> timestamp_s,
                    const std::optional<OdometryPose>& odometry, Evidence* evidence = nullptr,
                    const AllowedPlaces& allowed = {});

  /// The first half of process() and query(), about half of their time: what the image is
  /// recognised by. So one thread can prepare the next image while another one processes this one.
  /// May run beside any other function but set_mask() and set_camera(). Throws Error (kind input)
  /// if the image cannot be used.
  [[nodiscard]] PreparedImage prepare(const cv::Mat& image) const;

  /// The other half. The answer is that of process() for the same image. Another detector may have
  /// prepared it, if its settings, mask and calibration were the same.
  Detection process(PreparedImage prepared, std::optional<double> timestamp_s = std::nullopt,
                    const std::optional<OdometryPose>& odometry = std::nullopt,
                    Evidence* evidence = nullptr, const AllowedPlaces& allowed = {});

  /// The same for an image whose content and features a MapStorage received in an earlier run. They
  /// give the answer that the image itself would give; set_mask() does not apply. Throws Error
  /// (kind input) for incomplete features, too.
  Detection process(const BinaryContent& content, Features features,
                    std::optional<double> timestamp_s = std::nullopt,
                    const std::optional<OdometryPose>& odometry = std::nullopt);

  /// The answer of process() without odometry, without adding the image. `ranking`: if not null,
  /// receives all candidates, best first, at the cost of verifying each of them. Only the first can
  /// be a loop.
  [[nodiscard]] Detection query(const cv::Mat& image,
                                std::optional<double> timestamp_s = std::nullopt,
                                std::vector<RankedPlace>* ranking = nullptr,
                                Evidence* evidence = nullptr,
                                const AllowedPlaces& allowed = {}) const;

  /// The same for a prepared image, whose features remain for the caller.
  [[nodiscard]] Detection query(const PreparedImage& prepared,
                                std::optional<double> timestamp_s = std::nullopt,
                                std::vector<RankedPlace>* ranking = nullptr,
                                Evidence* evidence = nullptr,
                                const AllowedPlaces& allowed = {}) const;

  /// Counts a frame that has no usable image, so that frame numbers match the camera's. It is never
  /// a candidate. Throws Error (kind input) for odometry, see check_odometry().
  Detection skip(std::optional<double> timestamp_s = std::nullopt,
                 const std::optional<OdometryPose>& odometry = std::nullopt);

  /// Excludes part of all images from now on, such as the robot's own body or the rim of the lens:
  /// where `mask`, 8 bits and grey, is 0, there is no content and no feature has its centre. An
  /// image of another size is then an Error (kind input). The map does not store the mask. An empty
  /// one excludes nothing. Throws Error (kind option) if `mask` is of another type or excludes the
  /// whole image, or Error (kind input) if it has less than 32 x 32 pixels. Copies it.
  void set_mask(const cv::Mat& mask);

  /// The calibration of all images from now on, also of those in the map. Matches then have to
  /// agree with an epipolar geometry of rays, so that a fisheye is no obstacle. An image of another
  /// size is an Error (kind input). The map does not store it. None = not known, the initial state.
  /// Throws Error (kind input) if it is not valid or has no size_px.
  void set_camera(const std::optional<CameraModel>& camera);

  /// Removes a place, such as a culled key frame, also from the map. From now on it is no candidate
  /// and affects no answer. Frames keep their numbers. Removing it again changes nothing. Throws
  /// Error (kind option) if there is no such place, and whatever MapStorage::remove throws. Frees
  /// its features, but not its content of 610 bytes. Session 0 is this session.
  void remove(const SessionFrame& place);

  /// Withdraws a loop that turned out to be wrong, such as one that the back end refused. Its
  /// support for later matches ends. Frames that show the same view as `query` do not match there
  /// again. The map records the pair as rejected. Throws Error (kind option) if there are no such
  /// frames, and whatever MapStorage::reject throws. Session 0 is this session.
  void reject(const SessionFrame& query, const SessionFrame& match);

  /// Rejects the match of `loop`, a detection of this detector.
  void reject(const Detection& loop);

  /// The features that verification compares, such as for the relative pose of a loop. Empty for a
  /// frame that was unreadable or removed. Session 0 is this session. Throws Error (kind option) if
  /// there is no such frame, and whatever MapStorage::features throws. Copies up to 50 KB.
  [[nodiscard]] Features features_of(const SessionFrame& place) const;

  /// Number of frames in this session so far.
  [[nodiscard]] PlaceId size() const;

  [[nodiscard]] const LoopDetectorOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
