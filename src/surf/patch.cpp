// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "patch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace loopbit {

void upright_patch(const IntegralImage& integral, const Keypoint& keypoint, const Kernels& kernels,
                   Patch& patch) {
  kernels.upright_cells(integral.view(), keypoint.x_px, keypoint.y_px, keypoint.scale,
                        patch.data());
}

void turned_patch(const IntegralImage& integral, const Keypoint& keypoint, Patch& patch) {
  const cv::Size size = integral.size_px();
  const int side = std::max(1, cvRound(keypoint.scale));
  const float norm = 1.0F / static_cast<float>(side * side);
  const float cosine = std::cos(keypoint.angle_rad) * keypoint.scale;
  const float sine = std::sin(keypoint.angle_rad) * keypoint.scale;
  const float to_corner = 1.0F - static_cast<float>(side) / 2;
  for (std::size_t i = 0; i < kCells; ++i) {
    for (std::size_t k = 0; k < kCells; ++k) {
      const float along = static_cast<float>(k) - 10.0F;
      const float down = static_cast<float>(i) - 10.0F;
      const float x_px = keypoint.x_px + cosine * along - sine * down + to_corner;
      const float y_px = keypoint.y_px + sine * along + cosine * down + to_corner;
      const int x = std::clamp(static_cast<int>(x_px), 0, size.width - side);
      const int y = std::clamp(static_cast<int>(y_px), 0, size.height - side);
      patch[i * kCellStride + k] =
          static_cast<float>(integral.box(x, y, x + side, y + side)) * norm;
    }
  }
}

float dominant_angle(const IntegralImage& integral, const Keypoint& keypoint) {
  constexpr int kRadius = 6;
  constexpr int kSectors = 72;
  constexpr int kWindow = 12;  // 60 degrees
  constexpr float kSigma = 2.5F;
  const int step = std::max(1, cvRound(keypoint.scale));
  const int x0 = static_cast<int>(keypoint.x_px + 1.0F);
  const int y0 = static_cast<int>(keypoint.y_px + 1.0F);
  const cv::Size size = integral.size_px();
  const auto box = [&](int left, int top, int right, int bottom) {
    return static_cast<float>(
        integral.box(std::clamp(left, 0, size.width), std::clamp(top, 0, size.height),
                     std::clamp(right, 0, size.width), std::clamp(bottom, 0, size.height)));
  };
  std::array<cv::Point2f, kSectors> sectors{};
  for (int v = -kRadius; v <= kRadius; ++v) {
    for (int u = -kRadius; u <= kRadius; ++u) {
      if (u * u + v * v >= kRadius * kRadius) continue;
      const float weight = std::exp(-static_cast<float>(u * u + v * v) / (2 * kSigma * kSigma));
      const int x = x0 + u * step;
      const int y = y0 + v * step;
      const int reach = 2 * step;
      const float dx =
          box(x, y - reach, x + reach, y + reach) - box(x - reach, y - reach, x, y + reach);
      const float dy =
          box(x - reach, y, x + reach, y + reach) - box(x - reach, y - reach, x + reach, y);
      const auto sector = static_cast<std::size_t>(cv::fastAtan2(dy, dx) * (kSectors / 360.0F));
      sectors[sector % kSectors] += weight * cv::Point2f(dx, dy);
    }
  }
  cv::Point2f best;
  for (int first = 0; first < kSectors; ++first) {
    cv::Point2f sum;
    for (int i = first; i < first + kWindow; ++i) {
      sum += sectors[static_cast<std::size_t>(i % kSectors)];
    }
    if (sum.dot(sum) > best.dot(best)) best = sum;
  }
  return cv::fastAtan2(best.y, best.x) * (std::numbers::pi_v<float> / 180.0F);
}

}  // namespace loopbit
