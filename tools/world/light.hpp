// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "color.hpp"
#include "scene.hpp"
#include "town.hpp"

namespace loopbit::town {

/// Sun, sky and lamps of a lap.
struct Light {
  double azimuth_rad = 0.6;  // of the sun, from east to north
  double rise = 1.0;         // tangent of its elevation
  Vec2 to_sun;               // unit vector in the plane, from azimuth_rad
  Color sun;                 // on a surface that faces it
  Color ambient;
  Color sky_top;
  Color sky_low;
  Color cloud;
  Color lamp;  // of street lamps and lit windows; black by day
  float cloud_cover = 0.5F;
  float cloud_shift = 0.0F;
};

/// The light of `lap`, `change` (0 to 1) of the way from the first lap's to a light of its own, and
/// then `night` (0 to 1) of the way to darkness.
Light light_of_lap(std::uint32_t seed, int lap, double change, float night);

/// The sky in the direction (x, y, rise), where (x, y) is a unit vector and rise a tangent >= 0.
Color sky_color(const Light& light, Vec2 direction, float rise);

/// The shadows of houses. Remembers the heights it has looked up; not thread-safe.
class Shadows {
 public:
  /// `town` must outlive the shadows.
  Shadows(const Town& town, const Light& light);

  /// The height below which `point`, in a street, is in the shade, in metres; may be below 0.
  [[nodiscard]] float height_at(Vec2 point);

 private:
  struct Memory {
    LotKey key;
    float top_m = -1.0F;
  };
  [[nodiscard]] float top_m(const LotKey& key);

  const Town& town_;
  Vec2 to_sun_;
  double rise_;
  std::vector<Memory> memory_;
  Memory last_;
};

}  // namespace loopbit::town
