// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "reach.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

#include "loopbit/rigid_motion.hpp"

namespace loopbit {
namespace {

/// From the new camera, as the covariance is.
cv::Vec3d position_of_from(const Motion& motion) {
  const cv::Matx33d back = motion.T_from_to.get_minor<3, 3>(0, 0).t();
  return -(back * rigid::translation(motion.T_from_to));
}

cv::Matx33d position_covariance(const Motion& motion) {
  return motion.covariance.get_minor<3, 3>(0, 0);
}

double chi2_of(const cv::Vec3d& vector, const cv::Matx33d& covariance) {
  return vector.dot(covariance.inv() * vector);
}

}  // namespace

cv::Vec3d Reach::views_sq(const DecisionOptions& decision) {
  const cv::Vec3d reach_m(decision.reach_m, decision.reach_up_m, decision.reach_m);
  return reach_m.mul(reach_m) / kMaxChi2;
}

double Reach::chi2(int frame) const {
  const auto [known, is_new] = chi2_.try_emplace(frame, 0);
  if (is_new) known->second = measure(frame);
  return known->second;
}

double Reach::chi2(const Shortcuts::Loop& by, int frame) const {
  const auto before = track_->between(frame, by.match);
  const auto after = track_->to_next(by.frame, now_);
  if (!before || !after) return 0;
  return chi2(chained(chained(*before, across(*track_, by.match, by.frame, views_sq_)), *after));
}

double Reach::chi2(const Motion& to_now) const {
  return chi2_of(position_of_from(to_now),
                 position_covariance(to_now) + cv::Matx33d::diag(views_sq_));
}

double Reach::measure(int frame) const {
  const auto direct = track_->to_next(frame, now_);
  if (!direct) return 0;
  const double far = chi2(*direct);
  if (far > kMaxChi2) return far;
  const auto path = paths_->from(frame, now_, *direct);
  if (!path) return far;
  const double contradiction = chi2_of(position_of_from(*path) - position_of_from(*direct),
                                       position_covariance(*path) + position_covariance(*direct));
  // Then a loop on the path is wrong, most likely.
  return contradiction > kMaxChi2 ? far : std::max(far, chi2(*path));
}

double Reach::weight(double chi2) {
  constexpr double kMean = 3;  // of three degrees of freedom
  return std::exp(-0.5 * std::max(0.0, chi2 - kMean));
}

}  // namespace loopbit
