// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "move_agreement.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

#include "loopbit/rigid_motion.hpp"

namespace loopbit {
namespace {

/// How much a camera moves and turns, squared.
struct Size {
  double move_sq;
  double turn_sq;
};

double squared(const cv::Vec3d& vector) { return vector.dot(vector); }

double turn_sq(const cv::Matx44d& transform) { return std::pow(rigid::angle(transform), 2); }

Size size_of(const Motion& motion) {
  return {squared(rigid::translation(motion.T_from_to)), turn_sq(motion.T_from_to)};
}

/// The mean variance of one axis.
double variance(const Motion& motion, int first_row) {
  double sum = 0;
  for (int i = first_row; i < first_row + 3; ++i) sum += motion.covariance(i, i);
  return sum / 3;
}

}  // namespace

MoveAgreement::MoveAgreement(const OdometryTrack& track, const Motion& latest, const Around& begin)
    : track_(track), latest_(latest), begin_(begin.at) {
  Size step = size_of(latest);
  const auto include = [&](int from, int to) {
    const auto beside = track.between(from, to);
    if (!beside) return;
    const Size size = size_of(*beside);
    step.move_sq = std::max(step.move_sq, size.move_sq);
    step.turn_sq = std::max(step.turn_sq, size.turn_sq);
  };
  if (begin.before) include(*begin.before, begin.at);
  if (begin.after) include(begin.at, *begin.after);
  constexpr double kUniform = 1.0 / 3;  // the variance of -1 to 1
  known_ = {kUniform * step.move_sq + variance(latest, 0),
            kUniform * step.turn_sq + variance(latest, 3)};
}

std::optional<double> MoveAgreement::likelihood(int end) const {
  const auto move = track_.between(begin_, end);
  if (!move) return std::nullopt;
  const double move_sq =
      squared(rigid::translation(latest_.T_from_to) - rigid::translation(move->T_from_to));
  const double move_chi2 = move_sq / (known_.move + variance(*move, 0));
  const double turn_chi2 = turn_sq(rigid::inverse(move->T_from_to) * latest_.T_from_to) /
                           (known_.turn + variance(*move, 3));
  return std::exp(-0.5 * (move_chi2 + turn_chi2));
}

}  // namespace loopbit
