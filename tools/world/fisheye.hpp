// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "color.hpp"
#include "column_tracer.hpp"

namespace loopbit::town {

/// An equidistant lens: a point at an angle from the axis is seen at a distance from the middle of
/// the image that is proportional to the angle. Its image is put together from those of three
/// pinhole cameras that look left, ahead and right.
class FisheyeLens {
 public:
  /// `camera`: where it is and the size of the image; its horizon is the row of the axis.
  /// `across_rad`: what the lens sees across the width of the image.
  FisheyeLens(const Camera& camera, double across_rad);

  /// px per radian.
  [[nodiscard]] double focal_px() const { return focal_px_; }

  /// The image: columns, of rows. `draw` fills such an image for a pinhole camera. Black beyond 80
  /// degrees from the axis.
  using Image = std::vector<std::vector<Color>>;
  [[nodiscard]] Image render(const std::function<void(const Camera&, Image&)>& draw) const;

 private:
  struct Ray {
    double right = 0;
    double down = 0;
    double ahead = 0;
  };
  [[nodiscard]] bool ray_of(int column, int row, Ray& ray) const;
  [[nodiscard]] Color color_of(const Ray& ray, const std::array<Image, 3>& images) const;

  Camera camera_;
  double focal_px_;
  std::array<Camera, 3> faces_;
};

}  // namespace loopbit::town
