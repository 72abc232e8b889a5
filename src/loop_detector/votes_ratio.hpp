// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopbit {

/// A median, a mean or a deviation of fewer places tells little.
inline constexpr std::size_t kMinNull = 8;

/// Of a number of votes, so that its deviation hardly depends on the number (Anscombe 1948).
double stabilized(int votes);

/// What wrong places show a frame.
class VotesNull {
 public:
  /// From the stabilized votes of places that look equally alike; a few may be right.
  static VotesNull by_medians(std::vector<double> votes);
  /// The same at less cost, if none is right: from their number, their sum and that of their
  /// squares.
  static VotesNull by_means(double number, double sum, double sum_sq);

  /// How far votes stand out, in standard deviations.
  [[nodiscard]] double sigmas(int votes) const {
    return (stabilized(votes) - middle_) / deviation_;
  }

 private:
  VotesNull(double middle, double deviation);

  double middle_ = 0;
  double deviation_ = 0;
};

/// Within what one frame may say.
double clamped_sigmas(double sigmas);

/// What the places that the robot has just left show its frames. It is surely elsewhere now, but
/// its surroundings are the same, and those of similar places need not be: a corridor looks more
/// like itself than like the street that led there.
class JustLeft {
 public:
  /// With the `sigmas` of such places in one more frame; what was known before fades.
  [[nodiscard]] JustLeft with(std::span<const double> sigmas) const;

  /// How far `sigmas` stand out, where these surroundings show more than similar places do.
  [[nodiscard]] double beyond(double sigmas) const { return (sigmas - mean_) / deviation_; }

 private:
  double count_ = 0;
  double sum_ = 0;
  double sum_sq_ = 0;
  double mean_ = 0;
  double deviation_ = 1;
};

/// How much likelier the right place stands out from wrong ones by so many deviations than another
/// wrong one.
class VotesRatio {
 public:
  /// `num_null`: of wrong ones.
  explicit VotesRatio(std::size_t num_null);

  [[nodiscard]] double of(double sigmas) const;

 private:
  double degrees_ = 0;
  double factor_ = 0;  ///< of the density of Student's t distribution
};

}  // namespace loopbit
