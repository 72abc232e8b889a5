// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "shader.hpp"

#include <algorithm>
#include <cmath>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr int kSkyStep = 4;         // rows; between them the sky is interpolated
constexpr float kOffWall_m = 0.6F;  // further than any house is set back
constexpr double kGroundFar_m = 400.0;
constexpr double kHazeHalf_m = 280.0;
constexpr float kPenumbra_m = 0.25F;
constexpr float kContact_m = 0.6F;
constexpr float kContactShade = 0.4F;
constexpr float kGlobe_m = 0.56F;  // of a street lamp, from its top

Vec2 normal_of(const Prism& prism, Face face) {
  const Vec2 v_axis = left_of(prism.axis);
  switch (face) {
    case Face::v_low:
      return v_axis * -1.0;
    case Face::v_high:
      return v_axis;
    case Face::u_low:
      return prism.axis * -1.0;
    case Face::u_high:
      break;
  }
  return prism.axis;
}

bool on_side(Face face) { return face == Face::u_low || face == Face::u_high; }

}  // namespace

Shader::Shader(const Camera& camera, const Scene& scene, const Town& town, const Light& light,
               std::uint32_t ground_seed)
    : camera_(camera),
      scene_(scene),
      light_(light),
      pitch_m_(town.pitch_m()),
      ground_seed_(ground_seed),
      level_sun_(static_cast<float>(1.0 / std::sqrt(1.0 + light.rise * light.rise))),
      upright_sun_(level_sun_ * static_cast<float>(light.rise)),
      shadows_(town, light),
      bare_ground_(town) {
  if (light.lamp.r <= 0) return;
  for (const Billboard& board : scene.billboards) {
    if (board.shape == Shape::lamp) lamps_.push_back(board.at);
  }
}

Color Shader::in_haze(Color color, double depth_m) const {
  const double far = depth_m / kHazeHalf_m;
  const auto share = static_cast<float>(far * far / (1.0 + far * far));
  return blend(color, light_.sky_low, share);
}

Color Shader::lit(Color color, float sun, Vec2 at, double z_m) const {
  const Color daylight = light_.ambient + light_.sun * sun;
  if (lamps_.empty()) return color * daylight;
  return color * (daylight + light_.lamp * lamp_light(at, z_m));
}

float Shader::lamp_light(Vec2 at, double z_m) const {
  constexpr double kReach_m = 25.0;
  constexpr double kLamp_m = 5.0;  // above the ground
  constexpr double kPower = 9.0;
  double sum = 0;
  for (const Vec2 lamp : lamps_) {
    const double flat_sq = dot(lamp - at, lamp - at);
    if (flat_sq > kReach_m * kReach_m) continue;
    sum += kPower / (2.0 + flat_sq + (kLamp_m - z_m) * (kLamp_m - z_m));
  }
  return std::min(1.0F, static_cast<float>(sum));
}

Color Shader::in_season(Color color, std::uint32_t seed, float x, float y) const {
  return scene_.season > 0 ? in_snow(color, seed, x, y, scene_.season) : color;
}

float Shader::metres_a_pixel(double depth_m) const {
  return static_cast<float>(depth_m / camera_.focal_px);
}

// Metres up for each metre of depth, along the ray through the middle of a row.
double Shader::rise_of(float row) const { return (camera_.horizon_px - row) / camera_.focal_px; }

// Blends the row of the upper edge with the background, by coverage.
template <typename ColorAt>
void Shader::fill(const Piece& piece, std::vector<Color>& rows, const ColorAt& color_at) const {
  const int first = std::max(0, floor_int(piece.top_px));
  const int end = std::min(camera_.height_px, static_cast<int>(std::ceil(piece.bottom_px)));
  for (int row = first; row < end; ++row) {
    const float middle = static_cast<float>(row) + 0.5F;
    const Color color = color_at(std::clamp(middle, piece.top_px, piece.bottom_px));
    const float covered = clamp01(static_cast<float>(row + 1) - piece.top_px);
    Color& pixel = rows[static_cast<std::size_t>(row)];
    pixel = covered < 1.0F ? blend(pixel, color, covered) : color;
  }
}

void Shader::draw_sky(float skyline_px, std::vector<Color>& rows) const {
  const double length = std::sqrt(dot(ray_, ray_));
  const Vec2 direction = ray_ * (1.0 / length);
  const int end = std::clamp(static_cast<int>(std::ceil(skyline_px)), 0, camera_.height_px);
  const auto sky_at = [&](int row) {
    const double rise = std::max(0.0, rise_of(static_cast<float>(row) + 0.5F) / length);
    return sky_color(light_, direction, static_cast<float>(rise));
  };
  Color above = sky_at(0);
  for (int row = 0; row < end; row += kSkyStep) {
    const Color below = sky_at(row + kSkyStep);
    for (int step = 0; step < std::min(kSkyStep, end - row); ++step) {
      const int at = row + step;
      rows[static_cast<std::size_t>(at)] = blend(above, below, static_cast<float>(step) / kSkyStep);
    }
    above = below;
  }
}

void Shader::draw_ground(const Piece& piece, std::vector<Color>& rows) {
  const double length = std::sqrt(dot(ray_, ray_));
  const auto east = static_cast<float>(std::abs(ray_.x) / length);
  const auto north = static_cast<float>(std::abs(ray_.y) / length);
  fill(piece, rows, [&](float row) {
    const double depth = std::min(camera_.eye_m / std::max(1e-6, -rise_of(row)), kGroundFar_m);
    const Vec2 at = camera_.eye + ray_ * depth;
    const float across = metres_a_pixel(depth);
    const auto away = static_cast<float>(across * depth / camera_.eye_m);
    Color color = bare_ground_.at(at)
                      ? bare_ground_color(ground_seed_, at, pitch_m_, std::max(away, across))
                      : ground_color(ground_seed_, at, pitch_m_, east * away + north * across,
                                     north * away + east * across);
    color = in_season(color, ground_seed_, static_cast<float>(at.x), static_cast<float>(at.y));
    const float shade = clamp01(shadows_.height_at(at) / kPenumbra_m + 0.5F);
    const auto to_foot = static_cast<float>(piece.end_m - depth);
    color = color * (1.0F - kContactShade * clamp01(1.0F - to_foot / kContact_m));
    return in_haze(lit(color, upright_sun_ * (1.0F - shade), at, 0.0), depth);
  });
}

template <typename ColorAt, typename GlowAt>
void Shader::fill_wall(const Piece& piece, Vec2 normal, std::vector<Color>& rows,
                       const ColorAt& color_at, const GlowAt& glow_at) {
  const Vec2 at = camera_.eye + ray_ * piece.depth_m;
  const float facing = level_sun_ * static_cast<float>(std::max(0.0, dot(normal, light_.to_sun)));
  const float shade_m = facing > 0 ? shadows_.height_at(at + normal * kOffWall_m) : 0.0F;
  // A wall gets more light from the open sky the less it faces the ground.
  const float sky = 0.9F + 0.1F * static_cast<float>(dot(normal, {0.6, 0.8}));
  fill(piece, rows, [&](float row) {
    const auto z = static_cast<float>(camera_.eye_m + rise_of(row) * piece.depth_m);
    const float in_sun = clamp01((z - shade_m) / kPenumbra_m + 0.5F);
    Color color = lit(color_at(z) * sky, facing * in_sun, at, z);
    if (light_.lamp.r > 0) color = color + light_.lamp * (0.8F * glow_at(z));
    return in_haze(color, piece.depth_m);
  });
}

void Shader::draw_wall(const Piece& piece, std::vector<Color>& rows) {
  const Prism& prism = scene_.prisms[static_cast<std::size_t>(piece.index)];
  const Vec2 normal = normal_of(prism, piece.face);
  const Vec2 local = camera_.eye + ray_ * piece.depth_m - prism.centre;
  const bool side = on_side(piece.face);
  const auto u = static_cast<float>(dot(local, prism.axis));
  const auto v = static_cast<float>(dot(local, left_of(prism.axis)));
  const float along = side ? v - prism.v_min() : u + prism.half_length_m;
  const float high = metres_a_pixel(piece.depth_m);
  const float wide = high / std::max(0.01F, static_cast<float>(std::abs(dot(normal, ray_))));
  const float pixel = std::max(high, wide);
  switch (prism.wall) {
    case Wall::house: {
      const float width = side ? prism.v_max() - prism.v_min() : 2 * prism.half_length_m;
      const HouseColumn column(prism.style, prism.detail, width, along, wide);
      return fill_wall(
          piece, normal, rows, [&](float z) { return column.at(z, high); },
          [&](float z) { return column.glow(z, high); });
    }
    case Wall::plain:
      return fill_wall(piece, normal, rows,
                       [&](float z) { return plain_wall_color(prism.detail, along, z, pixel); });
    case Wall::chimney:
      return fill_wall(piece, normal, rows,
                       [&](float z) { return chimney_color(prism.style, along, z, pixel); });
    case Wall::hedge:
      return fill_wall(piece, normal, rows, [&](float z) {
        return in_season(hedge_color(prism.detail, along, z, pixel), prism.detail, along, z);
      });
    case Wall::car:
      return fill_wall(piece, normal, rows, [&](float z) {
        return side ? car_side_color(prism, v, z, pixel)
                    : car_end_color(prism, u, z, pixel, piece.face == Face::v_high);
      });
  }
}

void Shader::draw_slope(const Piece& piece, std::vector<Color>& rows) const {
  const Prism& prism = scene_.prisms[static_cast<std::size_t>(piece.index)];
  const Vec2 v_axis = left_of(prism.axis);
  const double v_step = dot(ray_, v_axis);
  // Height gained for each metre of v, and from it the share of sun on the slope.
  const double grade = std::abs(v_step) > 1e-9 ? piece.climb / v_step : 0.0;
  const double faces =
      (light_.rise - grade * dot(v_axis, light_.to_sun)) / std::sqrt(1.0 + grade * grade);
  const float sun = level_sun_ * static_cast<float>(std::max(0.0, faces));
  const double base = piece.height_m - piece.climb * piece.depth_m - camera_.eye_m;
  fill(piece, rows, [&](float row) {
    const double relative = rise_of(row) - piece.climb;
    const double depth = std::clamp(std::abs(relative) > 1e-9 ? base / relative : piece.end_m,
                                    piece.depth_m, piece.end_m);
    const Vec2 local = camera_.eye + ray_ * depth - prism.centre;
    const auto u = static_cast<float>(dot(local, prism.axis));
    const auto v = static_cast<float>(dot(local, v_axis));
    const float pixel =
        metres_a_pixel(depth) * static_cast<float>(1.0 + 1.0 / std::max(0.05, std::abs(relative)));
    const Color color = prism.wall == Wall::house
                            ? in_season(roof_color(prism.style, u, v, pixel), prism.detail, u, v)
                        : prism.wall == Wall::car ? car_top_color(prism, v, pixel)
                                                  : gray(0.5F);
    return in_haze(lit(color, sun, camera_.eye + ray_ * depth, piece.height_m), depth);
  });
}

void Shader::draw_board(const Piece& piece, std::vector<Color>& rows) {
  const Billboard& board = scene_.billboards[static_cast<std::size_t>(piece.index)];
  const Vec2 at = camera_.eye + ray_ * piece.depth_m;
  const auto x = static_cast<float>(-dot(at - board.at, left_of(camera_.forward)));
  const float shade_m = shadows_.height_at(at);
  const float pixel = metres_a_pixel(piece.depth_m);
  const int first = std::max(0, floor_int(piece.top_px));
  const int end = std::min(camera_.height_px, static_cast<int>(std::ceil(piece.bottom_px)));
  for (int row = first; row < end; ++row) {
    const double rise = rise_of(static_cast<float>(row) + 0.5F);
    const auto z = static_cast<float>(camera_.eye_m + rise * piece.depth_m);
    Color color;
    const float covered = billboard_color(board, x, z, pixel, color);
    if (covered <= 0) continue;
    const float in_sun = clamp01((z - shade_m) / kPenumbra_m + 0.5F);
    Color& seen = rows[static_cast<std::size_t>(row)];
    Color shown = lit(color, 0.7F * in_sun, at, z);
    const bool globe = board.shape == Shape::lamp && z > board.height_m - kGlobe_m;
    if (globe) shown = shown + light_.lamp;
    seen = blend(seen, in_haze(shown, piece.depth_m), covered);
  }
}

void Shader::draw(int column, const std::vector<Piece>& pieces, float skyline_px,
                  std::vector<Color>& rows) {
  ray_ = camera_.ray(column);
  draw_sky(skyline_px, rows);
  // NOLINTNEXTLINE(modernize-loop-convert): clang-tidy 14 cannot read std::views of GCC 12
  for (auto piece = pieces.rbegin(); piece != pieces.rend(); ++piece) {
    switch (piece->kind) {
      case Piece::Kind::ground:
        draw_ground(*piece, rows);
        break;
      case Piece::Kind::wall:
        draw_wall(*piece, rows);
        break;
      case Piece::Kind::slope:
        draw_slope(*piece, rows);
        break;
      case Piece::Kind::board:
        draw_board(*piece, rows);
        break;
    }
  }
}

}  // namespace loopbit::town
