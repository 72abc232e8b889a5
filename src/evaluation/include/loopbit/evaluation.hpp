// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "loopbit/detection.hpp"
#include "loopbit/ground_truth.hpp"

namespace loopbit {

/// What the decisions of a run come to. A query with a true earlier place is positive.
struct DecisionCounts {
  int positives = 0;  ///< positive queries that are scored
  int right = 0;      ///< loops whose match is a true earlier place
  int tolerated = 0;  ///< loops whose match is near enough not to be wrong
  int wrong = 0;      ///< all other loops
  int ignored = 0;    ///< frames left out of the score

  /// right / positives; 0 without positives.
  [[nodiscard]] double recall() const;
  /// right / (right + wrong); 1 without loops.
  [[nodiscard]] double precision() const;
};

/// Scores the shipped decision (status loop or not) of each frame against `truth`.
DecisionCounts count_decisions(std::span<const Detection> detections, const GroundTruth& truth);

}  // namespace loopbit
