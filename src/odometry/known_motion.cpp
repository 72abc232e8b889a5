// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/known_motion.hpp"

#include <fmt/format.h>
#include <opencv2/core/quaternion.hpp>

namespace loopbit {

std::string_view to_string(PoseKnown known) {
  switch (known) {
    case PoseKnown::nothing:
      return "nothing";
    case PoseKnown::rotation:
      return "rotation";
    case PoseKnown::direction:
      return "direction";
    case PoseKnown::metric:
      return "metric";
  }
  return "";
}

cv::Matx66d g2o_information(const KnownMotion& motion) {
  const int first = motion.known == PoseKnown::metric ? 0 : 3;
  cv::Matx66d information = cv::Matx66d::zeros();
  if (motion.known == PoseKnown::nothing) return information;
  const cv::Mat covariance(motion.motion.covariance);
  cv::Mat1d inverse;
  cv::invert(covariance(cv::Range(first, 6), cv::Range(first, 6)), inverse, cv::DECOMP_SVD);
  constexpr double kHalfAngle = 2;  // a rotation vector is twice the quaternion's
  for (int row = first; row < 6; ++row) {
    for (int column = first; column < 6; ++column) {
      const double unit = (row >= 3 ? kHalfAngle : 1) * (column >= 3 ? kHalfAngle : 1);
      information(row, column) = unit * inverse(row - first, column - first);
    }
  }
  return information;
}

std::string to_tum_pose(const cv::Matx44d& pose) {
  const cv::Quatd q = cv::Quatd::createFromRotMat(pose.get_minor<3, 3>(0, 0));
  const double sign = q.w < 0 ? -1 : 1;
  return fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g}", pose(0, 3), pose(1, 3),
                     pose(2, 3), sign * q.x + 0.0, sign * q.y + 0.0, sign * q.z + 0.0,  // not -0
                     sign * q.w);
}

std::string to_g2o_edge(const KnownMotion& motion, std::int64_t from, std::int64_t to) {
  const cv::Matx66d information = g2o_information(motion);
  std::string line =
      fmt::format("EDGE_SE3:QUAT {} {} {}", from, to, to_tum_pose(motion.motion.T_from_to));
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      line += fmt::format(" {:.9g}", information(row, column));
  }
  return line;
}

}  // namespace loopbit
