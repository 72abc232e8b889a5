// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "column_tracer.hpp"
#include "light.hpp"
#include "surfaces.hpp"
#include "town.hpp"

namespace loopbit::town {

/// Colours what the columns of one image see. Not thread-safe.
class Shader {
 public:
  /// `camera`, `scene`, `town` and `light` must outlive the shader.
  Shader(const Camera& camera, const Scene& scene, const Town& town, const Light& light,
         std::uint32_t ground_seed);

  /// Draws the pieces, which are sorted from near to far, and the sky above `skyline_px`.
  void draw(int column, const std::vector<Piece>& pieces, float skyline_px,
            std::vector<Color>& rows);

 private:
  void draw_sky(float skyline_px, std::vector<Color>& rows) const;
  void draw_ground(const Piece& piece, std::vector<Color>& rows);
  void draw_wall(const Piece& piece, std::vector<Color>& rows);
  void draw_slope(const Piece& piece, std::vector<Color>& rows) const;
  void draw_board(const Piece& piece, std::vector<Color>& rows);
  [[nodiscard]] Color in_haze(Color color, double depth_m) const;
  [[nodiscard]] Color lit(Color color, float sun, Vec2 at, double z_m) const;
  [[nodiscard]] float lamp_light(Vec2 at, double z_m) const;
  [[nodiscard]] Color in_season(Color color, std::uint32_t seed, float x, float y) const;
  [[nodiscard]] float metres_a_pixel(double depth_m) const;
  [[nodiscard]] double rise_of(float row) const;
  template <typename ColorAt>
  void fill(const Piece& piece, std::vector<Color>& rows, const ColorAt& color_at) const;
  template <typename ColorAt, typename GlowAt>
  void fill_wall(const Piece& piece, Vec2 normal, std::vector<Color>& rows, const ColorAt& color_at,
                 const GlowAt& glow_at);
  template <typename ColorAt>
  void fill_wall(const Piece& piece, Vec2 normal, std::vector<Color>& rows,
                 const ColorAt& color_at) {
    fill_wall(piece, normal, rows, color_at, [](float /*z*/) { return 0.0F; });
  }

  const Camera& camera_;
  const Scene& scene_;
  const Light& light_;
  double pitch_m_;
  std::uint32_t ground_seed_;
  float level_sun_;    // share of the sun's light on a wall that faces it
  float upright_sun_;  // share of it on the ground
  Shadows shadows_;
  BareGround bare_ground_;
  std::vector<Vec2> lamps_;  // that shine
  Vec2 ray_;
};

}  // namespace loopbit::town
