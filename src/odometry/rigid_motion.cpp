// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/rigid_motion.hpp"

#include <cmath>

namespace loopbit::rigid {

cv::Vec3d translation(const cv::Matx44d& transform) {
  return {transform(0, 3), transform(1, 3), transform(2, 3)};
}

double angle(const cv::Matx44d& transform) {
  const cv::Vec3d axis(transform(2, 1) - transform(1, 2), transform(0, 2) - transform(2, 0),
                       transform(1, 0) - transform(0, 1));
  return std::atan2(cv::norm(axis) / 2,
                    (transform(0, 0) + transform(1, 1) + transform(2, 2) - 1) / 2);
}

cv::Matx44d inverse(const cv::Matx44d& transform) {
  const cv::Matx33d back = transform.get_minor<3, 3>(0, 0).t();
  const cv::Vec3d t = -(back * translation(transform));
  return {back(0, 0), back(0, 1), back(0, 2), t[0], back(1, 0), back(1, 1), back(1, 2), t[1],
          back(2, 0), back(2, 1), back(2, 2), t[2], 0,          0,          0,          1};
}

cv::Matx66d adjoint(const cv::Matx44d& transform) {
  const cv::Matx33d rotation = transform.get_minor<3, 3>(0, 0);
  const cv::Vec3d t = translation(transform);
  const cv::Matx33d cross(0, -t[2], t[1], t[2], 0, -t[0], -t[1], t[0], 0);
  const cv::Matx33d lever = cross * rotation;
  cv::Matx66d adjoint = cv::Matx66d::zeros();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      adjoint(row, column) = rotation(row, column);
      adjoint(row + 3, column + 3) = rotation(row, column);
      adjoint(row, column + 3) = lever(row, column);
    }
  }
  return adjoint;
}

}  // namespace loopbit::rigid
