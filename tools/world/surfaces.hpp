// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "color.hpp"
#include "scene.hpp"

// What surfaces look like, before light: colours as functions of metres on the surface and of the
// footprint, the metres that one pixel sees. Detail finer than a pixel fades to its mean.
namespace loopbit::town {

/// One image column of a house's wall: all that depends on the place along the wall is worked out
/// once for the column.
class HouseColumn {
 public:
  /// `u` metres along a wall of `width_m`, a pixel seeing `footprint_u` along it.
  HouseColumn(const HouseStyle& style, std::uint32_t detail, float width_m, float u,
              float footprint_u);

  /// The colour `z` metres above the ground, a pixel seeing `footprint` up the wall.
  [[nodiscard]] Color at(float z, float footprint) const;

  /// How much of the pixel is a window that is lit at night, 0 to 1.
  [[nodiscard]] float glow(float z, float footprint) const;

 private:
  [[nodiscard]] Color masonry(float z, float footprint) const;
  [[nodiscard]] Color ground_floor(Color color, float z, float footprint) const;
  [[nodiscard]] Color upper_floor(Color color, int floor, float y, float footprint) const;
  [[nodiscard]] Color window(Color color, int floor, float y, float footprint) const;
  [[nodiscard]] Color dressing(Color color, float y, float footprint) const;
  [[nodiscard]] Color attic(Color color, float z, float footprint) const;
  [[nodiscard]] Color pane(std::uint32_t window_seed, float y, float footprint) const;
  [[nodiscard]] Color shop(Color color, float z, float footprint) const;
  [[nodiscard]] Color door(Color color, float z, float footprint) const;
  [[nodiscard]] float across(float low, float high) const { return cover(x_, low, high, fu_); }

  const HouseStyle& style_;
  std::uint32_t detail_;
  float u_;
  float fu_;
  float from_middle_;  // of the wall
  int bay_;
  float x_;  // from the middle of the bay
  bool door_bay_;
};

/// Other walls: u along the wall, z up. A car's side has v from tail to nose, its ends u across.
Color plain_wall_color(std::uint32_t detail, float u, float z, float footprint);
Color hedge_color(std::uint32_t detail, float u, float z, float footprint);
Color chimney_color(const HouseStyle& style, float u, float z, float footprint);
Color car_side_color(const Prism& car, float v, float z, float footprint);
Color car_end_color(const Prism& car, float u, float z, float footprint, bool nose);

/// Surfaces seen from above or sloping; u along the axis, v across.
Color roof_color(const HouseStyle& style, float u, float v, float footprint);
Color car_top_color(const Prism& car, float v, float footprint);

/// The ground at a point of the town whose crossings are pitch_m apart.
Color ground_color(std::uint32_t seed, Vec2 at, double pitch_m, float footprint_x,
                   float footprint_y);

/// The same where it has neither paint nor wear.
Color bare_ground_color(std::uint32_t seed, Vec2 at, double pitch_m, float footprint);

/// A surface that is wet and has snow in patches; both grow with `season`, 0 to 1.
Color in_snow(Color color, std::uint32_t seed, float x, float y, float season);

/// Glyph-like marks, 0 to 1: letters `height_m` high on a line that begins at x = 0, y from its
/// foot.
float glyphs(std::uint32_t seed, float x, float y, float height_m, float footprint);

/// A billboard at x metres right of its middle and z above the ground. Returns how much of the
/// pixel it covers, 0 to 1.
float billboard_color(const Billboard& board, float x, float z, float footprint, Color& color);

}  // namespace loopbit::town
