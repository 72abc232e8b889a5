// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "patch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace loopbit {

void upright_patch(const IntegralImage& integral, const Keypoint& keypoint,
                   const SurfKernels& kernels, Patch& patch) {
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
  for (std::size_t i = 0; i < kPatchCells; ++i) {
    for (std::size_t k = 0; k < kPatchCells; ++k) {
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
  constexpr int kReach = kRadius + 1;  // of a wavelet within the radius
  constexpr std::size_t kSide = 2 * kReach + 1;

  const double scale = keypoint.scale;
  std::array<double, kSide * kSide> sums{};
  for (int v = -kReach, i = 0; v <= kReach; ++v) {
    for (int u = -kReach; u <= kReach; ++u, ++i) {
      sums[static_cast<std::size_t>(i)] =
          integral.sum_before(keypoint.x_px + 0.5 + u * scale, keypoint.y_px + 0.5 + v * scale);
    }
  }
  const auto sum = [&](int u, int v) {
    return sums[static_cast<std::size_t>(v + kReach) * kSide +
                static_cast<std::size_t>(u + kReach)];
  };
  // Of the pixels before an edge, those on its far side minus those on its near one.
  const auto across_x = [&](int u, int v) { return sum(u + 2, v) - 2 * sum(u, v) + sum(u - 2, v); };
  const auto across_y = [&](int u, int v) { return sum(u, v + 2) - 2 * sum(u, v) + sum(u, v - 2); };

  std::array<cv::Point2f, kSectors> sectors{};
  for (int v = -kRadius; v <= kRadius; ++v) {
    for (int u = -kRadius; u <= kRadius; ++u) {
      if (u * u + v * v >= kRadius * kRadius) continue;
      const float weight = std::exp(-static_cast<float>(u * u + v * v) / (2 * kSigma * kSigma));
      const auto dx = static_cast<float>(across_x(u, v + 1) - across_x(u, v - 1));
      const auto dy = static_cast<float>(across_y(u + 1, v) - across_y(u - 1, v));
      const auto sector = static_cast<std::size_t>(cv::fastAtan2(dy, dx) * (kSectors / 360.0F));
      sectors[sector % kSectors] += weight * cv::Point2f(dx, dy);
    }
  }
  cv::Point2f best;
  for (int first = 0; first < kSectors; ++first) {
    cv::Point2f in_window;
    for (int i = first; i < first + kWindow; ++i) {
      in_window += sectors[static_cast<std::size_t>(i % kSectors)];
    }
    if (in_window.dot(in_window) > best.dot(best)) best = in_window;
  }
  return cv::fastAtan2(best.y, best.x) * (std::numbers::pi_v<float> / 180.0F);
}

}  // namespace loopbit
