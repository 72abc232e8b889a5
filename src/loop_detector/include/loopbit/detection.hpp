// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "loopbit/odometry.hpp"
#include "loopbit/place_index.hpp"

namespace loopbit {

/// Why a frame is a loop, or why not.
enum class Status {
  loop,              ///< the match is accepted: the camera has been here before
  no_earlier_place,  ///< all places so far are too recent to be candidates
  no_similar_place,  ///< no earlier place looks similar, so there is no candidate
  few_matches,       ///< the best candidate shares too few features with the query
  no_geometry,       ///< no epipolar geometry explains enough of the matches
  low_score,         ///< the evidence is too weak to accept the match
  ambiguous,         ///< enough evidence, but similar-looking places share it
  unreachable,       ///< evidence of a place where the robot cannot be, by odometry
  unreadable,        ///< no usable image
};

inline constexpr std::array kAllStatuses{
    Status::loop,        Status::no_earlier_place, Status::no_similar_place,
    Status::few_matches, Status::no_geometry,      Status::low_score,
    Status::ambiguous,   Status::unreachable,      Status::unreadable};

/// The enumerator's name, as in loops.csv: "loop", "no_earlier_place", ...
std::string_view to_string(Status status);

/// Wall time of the steps of one detection, in milliseconds.
struct StepTimes {
  double content_ms = 0;       ///< step 1, binary content, with conversion to grey
  double retrieval_ms = 0;     ///< step 2, fast image retrieval
  double features_ms = 0;      ///< step 3, SURF
  double verification_ms = 0;  ///< step 3, matching, geometry and decision
};

/// Why a score is what it is: the terms of the log odds of the match, in nats. With their sum S the
/// score is 1 / (1 + exp(-S)). docs/method.md, section 4, has the formulas.
struct ScoreTerms {
  double votes = 0;     ///< features of frame and match that moved alike, against other places
  double geometry = 0;  ///< distinct inliers, against those of wrong places
  double path = 0;      ///< the frames before, and the steps beside the match in this frame
  double rivals = 0;    ///< places elsewhere that share the evidence; never above 0
  double prior = 0;     ///< that a robot returns to this very place; never above 0

  [[nodiscard]] double sum() const { return votes + geometry + path + rivals + prior; }
};

/// A frame of one of a map's sessions.
struct SessionFrame {
  int session = 0;  ///< from 1, in the order in which they were recorded
  int frame = 0;    ///< frame number in the session, from 0

  bool operator==(const SessionFrame&) const = default;
};

/// A loop of an earlier frame that a later one found, or withdrew.
struct LateLoop {
  PlaceId frame = 0;                                         ///< of this session
  std::optional<PlaceId> match = std::nullopt;               ///< as in Detection
  std::optional<SessionFrame> earlier_match = std::nullopt;  ///< as in Detection
  double score = 0;       ///< the probability that it is right, by all frames until now
  double similarity = 0;  ///< xi of frame and match
};

/// The answer for one frame, with the numbers behind it.
struct Detection {
  PlaceId frame = 0;  ///< number of the frame in this session, from 0
  std::optional<double> timestamp_s = std::nullopt;
  Status status = Status::no_earlier_place;
  std::optional<PlaceId> match =
      std::nullopt;  ///< the best candidate, accepted or not, if it is a frame of this session
  std::optional<SessionFrame> earlier_match =
      std::nullopt;  ///< the same, if it belongs to an earlier session of the map
  double score = 0;  ///< what was compared with decision.min_score
  std::optional<ScoreTerms> terms = std::nullopt;  ///< of the score; none without a match, if
                                                   ///< unreachable, or with decision.count_matches
  double similarity = 0;                           ///< xi of query and match
  int matches = 0;  ///< one-to-one feature matches between query and match
  int inliers = 0;  ///< matches that fit one epipolar geometry
  StepTimes times = {};
  /// Loops of frames of the last few views, which are sure only since this frame. In order.
  std::vector<LateLoop> late_loops = {};
  /// Loops reported before, also late ones, that are more likely wrong than right after this frame.
  std::vector<LateLoop> withdrawn_loops = {};
  std::optional<OdometryPose> odometry = std::nullopt;  ///< what process() was given
  std::string name = {};  ///< of the image in its source; run() sets it
  /// With a map on a server: the answer uses what was committed up to this epoch, nothing later,
  /// and this session. 0 = no such map.
  std::int64_t epoch = 0;
};

/// A candidate place for an image, with the numbers behind it; see LoopDetector::query.
struct RankedPlace {
  SessionFrame place;  ///< session 0 = this session
  double score = 0;
  double similarity = 0;
  int matches = 0;
  int inliers = 0;
};

}  // namespace loopbit
