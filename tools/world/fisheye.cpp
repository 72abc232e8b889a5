// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "fisheye.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// The edge of the image circle. Level pinhole cameras see little that is much steeper.
constexpr double kMaxAngle_rad = 80 * kDegree;
/// Between the axes of two neighbouring faces; each sees half of that to either side.
constexpr double kBetween_rad = 60 * kDegree;
constexpr double kCosHalf = 0.8660254037844386;
constexpr double kTanHalf = 0.5773502691896258;
/// Pixels of a face per pixel of the image, where they are densest.
constexpr double kOversampling = 1.2;
constexpr int kMargin_px = 2;

}  // namespace

FisheyeLens::FisheyeLens(const Camera& camera, double across_rad)
    : camera_(camera), focal_px_(camera.width_px / across_rad) {
  const double longest_px =
      std::max(camera.horizon_px, camera.height_px - camera.horizon_px);  // up or down
  const auto [sin, cos] = sin_cos(std::min(longest_px / focal_px_, kMaxAngle_rad));
  for (int i = 0; i < 3; ++i) {
    Camera& face = faces_[static_cast<std::size_t>(i)];
    face = camera;
    const auto turn = sin_cos((i - 1) * kBetween_rad);
    face.forward = camera.forward * turn.cos + left_of(camera.forward) * -turn.sin;
    face.focal_px = kOversampling * focal_px_;
    face.width_px = 2 * static_cast<int>(std::ceil(face.focal_px * kTanHalf) + kMargin_px);
    face.height_px =
        2 * static_cast<int>(std::ceil(face.focal_px * sin / cos / kCosHalf) + kMargin_px);
    face.horizon_px = face.height_px / 2.0;
  }
}

bool FisheyeLens::ray_of(int column, int row, Ray& ray) const {
  const double x = column + 0.5 - camera_.width_px / 2.0;
  const double y = row + 0.5 - camera_.horizon_px;
  const double radius = std::sqrt(x * x + y * y);
  const double angle = radius / focal_px_;
  if (angle > kMaxAngle_rad) return false;
  const auto [sin, cos] = sin_cos(angle);
  const double scale = radius > 0 ? sin / radius : 0;
  ray = {x * scale, y * scale, cos};
  return true;
}

Color FisheyeLens::color_of(const Ray& ray, const std::array<Image, 3>& images) const {
  const bool is_left = ray.right < -kTanHalf * ray.ahead;
  const bool is_right = ray.right > kTanHalf * ray.ahead;
  const int index = is_left ? 0 : is_right ? 2 : 1;
  const Camera& face = faces_[static_cast<std::size_t>(index)];
  const Image& image = images[static_cast<std::size_t>(index)];
  const auto turn = sin_cos((index - 1) * kBetween_rad);
  const double ahead = ray.ahead * turn.cos + ray.right * turn.sin;
  const double right = ray.right * turn.cos - ray.ahead * turn.sin;
  // From pixel centre to pixel centre.
  const double x = face.width_px / 2.0 + face.focal_px * right / ahead - 0.5;
  const double y = face.horizon_px + face.focal_px * ray.down / ahead - 0.5;
  const int left = std::clamp(floor_int(x), 0, face.width_px - 2);
  const int top = std::clamp(floor_int(y), 0, face.height_px - 2);
  const auto across = static_cast<float>(std::clamp(x - left, 0.0, 1.0));
  const auto along = static_cast<float>(std::clamp(y - top, 0.0, 1.0));
  const auto at = [&](std::size_t dx) {
    const auto& rows = image[static_cast<std::size_t>(left) + dx];
    return blend(rows[static_cast<std::size_t>(top)], rows[static_cast<std::size_t>(top) + 1],
                 along);
  };
  return blend(at(0), at(1), across);
}

FisheyeLens::Image FisheyeLens::render(
    const std::function<void(const Camera&, Image&)>& draw) const {
  std::array<Image, 3> images;
  for (std::size_t i = 0; i < images.size(); ++i) draw(faces_[i], images[i]);
  Image image(static_cast<std::size_t>(camera_.width_px),
              std::vector<Color>(static_cast<std::size_t>(camera_.height_px)));
  for (int column = 0; column < camera_.width_px; ++column) {
    for (int row = 0; row < camera_.height_px; ++row) {
      Ray ray;
      if (!ray_of(column, row, ray)) continue;
      image[static_cast<std::size_t>(column)][static_cast<std::size_t>(row)] =
          color_of(ray, images);
    }
  }
  return image;
}

}  // namespace loopbit::town
