// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "ray_pairs.hpp"

namespace loopbit {

double keypoint_sigma_px(const Keypoint& keypoint) {
  constexpr double kSigmaPerScale = 0.19;
  return kSigmaPerScale * static_cast<double>(keypoint.scale);
}

std::optional<Ray> ray_of(const PoseView& view, int keypoint) {
  const Keypoint& at = view.features->keypoint(keypoint);
  const cv::Size working = view.features->working_size_px;
  // A camera without a size is one of images that were not resized.
  const cv::Size size = view.camera->size_px.empty() ? working : view.camera->size_px;
  const double x_scale = static_cast<double>(size.width) / working.width;
  const double y_scale = static_cast<double>(size.height) / working.height;
  const cv::Vec2d pixel_px((static_cast<double>(at.x_px) + 0.5) * x_scale - 0.5,
                           (static_cast<double>(at.y_px) + 0.5) * y_scale - 0.5);
  Ray ray;
  cv::Matx32d by_pixel;
  const auto direction = unproject(*view.camera, pixel_px, &by_pixel);
  if (!direction) return std::nullopt;
  const double sigma_px = keypoint_sigma_px(at);
  ray.direction = *direction;
  ray.spread = by_pixel * cv::Matx22d(sigma_px * x_scale, 0, 0, sigma_px * y_scale);
  return ray;
}

}  // namespace loopbit
