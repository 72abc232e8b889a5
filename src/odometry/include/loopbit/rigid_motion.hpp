// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

/// Rigid motions as 4 x 4 matrices.
namespace loopbit::rigid {

cv::Vec3d translation(const cv::Matx44d& T);

/// The rotation angle in radians, 0 to pi.
double angle(const cv::Matx44d& T);

cv::Matx44d inverse(const cv::Matx44d& T);

/// Carries a small motion through `T`: T * [Exp(r) | p] = [Exp(r') | p'] * T, to first order.
cv::Matx66d adjoint(const cv::Matx44d& T);

}  // namespace loopbit::rigid
