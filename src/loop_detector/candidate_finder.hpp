// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/place_index.hpp"

#include "exclusion_window.hpp"
#include "path_motion.hpp"
#include "places.hpp"
#include "reach.hpp"
#include "session_odometry.hpp"

namespace loopbit {

/// The places that one frame is compared with.
struct FrameCandidates {
  /// The most similar ones, others that may match, and those just left, which may not.
  std::vector<Candidate> places = {};
  std::size_t num_similar = 0;  ///< so many of the first ones form the null of the votes
  std::size_t num_just_left = 0;
  std::vector<Candidate> too_far = {};  ///< of the most similar ones, those out of reach

  PlaceId end = 0;                         ///< of those that may match
  PlaceTest is_allowed = {};               ///< empty = all of them may
  std::unique_ptr<Reach> reach = nullptr;  ///< by odometry; null = it is not known

  [[nodiscard]] bool may_match(PlaceId place) const {
    return place < end && (!is_allowed || is_allowed(place));
  }
};

/// Step 2: finds the earlier places that look like a frame, and those where the robot is expected.
class CandidateFinder {
 public:
  /// All must outlive this.
  CandidateFinder(const LoopDetectorOptions& options, const Places& places,
                  SessionOdometry& odometry)
      : options_(options), places_(places), odometry_(odometry) {}

  /// What is known of a frame before it is compared with earlier places.
  struct Query {
    const BinaryContent& content;
    const ExclusionWindow::View& view;
    const Belief& prior;
    const std::optional<OdometryPose>& odometry;
  };

  /// `is_allowed`: see FrameCandidates. Not thread-safe with odometry.
  [[nodiscard]] FrameCandidates find(const Query& query, PlaceTest is_allowed) const;

 private:
  /// Looks up `times` as many places as usual.
  using LookUp = std::function<std::vector<Candidate>(int times)>;

  [[nodiscard]] Candidate candidate(PlaceId place, const BinaryContent& content) const;
  [[nodiscard]] bool is_back(const Query& query) const;
  [[nodiscard]] bool are_one_place(const std::vector<std::ptrdiff_t>& steps) const;
  void add_similar(const Query& query, FrameCandidates& found) const;
  std::size_t put_different_first(const LookUp& look_up, std::vector<Candidate>& similar) const;
  [[nodiscard]] std::vector<Candidate> different(const std::vector<Candidate>& similar,
                                                 std::size_t most) const;
  void keep_in_reach(const OdometryPose& odometry, FrameCandidates& found) const;
  void add_expected(const Query& query, FrameCandidates& found) const;
  void add_just_left(const Query& query, FrameCandidates& found) const;

  const LoopDetectorOptions& options_;
  const Places& places_;
  SessionOdometry& odometry_;
};

}  // namespace loopbit
