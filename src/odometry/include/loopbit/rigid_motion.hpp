// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

/// Rigid motions as 4 x 4 matrices.
namespace loopbit::rigid {

cv::Vec3d translation(const cv::Matx44d& transform);

/// The rotation angle in radians, 0 to pi.
double angle(const cv::Matx44d& transform);

cv::Matx44d inverse(const cv::Matx44d& transform);

/// Carries a small motion through `transform`: transform * [Exp(r) | p] = [Exp(r') | p'] *
/// transform, to first order.
cv::Matx66d adjoint(const cv::Matx44d& transform);

}  // namespace loopbit::rigid
