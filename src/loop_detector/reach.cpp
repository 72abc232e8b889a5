// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "reach.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

#include "loopbit/rigid_motion.hpp"

namespace loopbit {

double Reach::chi2(int frame) const {
  const auto [known, is_new] = chi2_.try_emplace(frame, 0);
  if (is_new) known->second = measure(frame);
  return known->second;
}

double Reach::measure(int frame) const {
  const auto motion = track_->to_next(frame, now_);
  if (!motion) return 0;
  // From the new camera, as the covariance is.
  const cv::Matx33d back = motion->T_from_to.get_minor<3, 3>(0, 0).t();
  const cv::Vec3d apart_m = back * rigid::translation(motion->T_from_to);
  const cv::Vec3d views_sq = reach_m_.mul(reach_m_) / kMaxChi2;
  const cv::Matx33d covariance = motion->covariance.get_minor<3, 3>(0, 0) +
                                 cv::Matx33d::diag({views_sq[0], views_sq[1], views_sq[2]});
  return apart_m.dot(covariance.inv() * apart_m);
}

double Reach::weight(double chi2) {
  constexpr double kMean = 3;  // of three degrees of freedom
  return std::exp(-0.5 * std::max(0.0, chi2 - kMean));
}

}  // namespace loopbit
