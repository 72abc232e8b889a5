// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace loopbit {

/// The matrix of the cross product with `v` from the left.
cv::Matx33d cross_matrix(const cv::Vec3d& v);

/// The rotation by the vector `r`, Rodrigues' formula.
cv::Matx33d rotation_by(const cv::Vec3d& r);

/// The rotation R that is best for pairs with b = R a, of which `sum` has all b a^T (Kabsch 1976).
cv::Matx33d best_rotation(const cv::Matx33d& sum);

/// Directions all over a half of the sphere: a translation and its opposite have the same essential
/// matrix. A spiral of equal areas.
std::vector<cv::Vec3d> half_sphere(int count);

}  // namespace loopbit
