// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "loopbit/place_index.hpp"

namespace loopbit {

/// Why a frame is a loop, or why not.
enum class Status {
  loop,              ///< the match is accepted: the camera has been at this place before
  no_earlier_place,  ///< every place so far is too recent to be a candidate
  no_similar_place,  ///< no earlier place looks alike: no candidate
  few_matches,       ///< candidates, but none shares enough features with the query
  no_geometry,       ///< features are shared, but no epipolar geometry explains enough of them
  low_score,         ///< a geometry, but too little evidence to accept the match
  ambiguous,         ///< enough evidence, but for other places that share it, which look alike
  unreadable,        ///< there was no usable image
};

inline constexpr std::array kAllStatuses{
    Status::loop,        Status::no_earlier_place, Status::no_similar_place, Status::few_matches,
    Status::no_geometry, Status::low_score,        Status::ambiguous,        Status::unreadable};

/// "loop", "no_earlier_place", ...: the enumerator's name, as it stands in loops.csv.
std::string_view to_string(Status status);

/// Wall time of the steps of one detection, in milliseconds.
struct StepTimes {
  double content_ms = 0;       ///< step 1, binary content, with conversion to grey
  double retrieval_ms = 0;     ///< step 2, fast image retrieval
  double features_ms = 0;      ///< step 3, SURF
  double verification_ms = 0;  ///< step 3, matching, geometry and decision
};

/// A frame of one of a map's sessions.
struct SessionFrame {
  int session = 0;  ///< from 1, in the order in which the map met them
  int frame = 0;    ///< in its session, from 0

  bool operator==(const SessionFrame&) const = default;
};

/// The answer for one frame, with the numbers behind it.
struct Detection {
  PlaceId frame = 0;  ///< number of the frame in this session, from 0
  std::optional<double> timestamp_s = std::nullopt;
  Status status = Status::no_earlier_place;
  std::optional<PlaceId> match =
      std::nullopt;  ///< the best candidate, accepted or not, if it is a frame of this session
  std::optional<SessionFrame> earlier_match =
      std::nullopt;       ///< the same, if it is of an earlier session of the map
  double score = 0;       ///< what was compared with decision.min_score
  double similarity = 0;  ///< xi of query and match
  int matches = 0;        ///< features shared by query and match, one to one
  int inliers = 0;        ///< those that one epipolar geometry explains
  StepTimes times = {};
};

/// A place that an image may show, with the numbers behind it; see LoopDetector::query.
struct RankedPlace {
  SessionFrame place;  ///< session 0 = of this session
  double score = 0;
  double similarity = 0;
  int matches = 0;
  int inliers = 0;
};

}  // namespace loopbit
