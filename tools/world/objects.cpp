// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <array>

#include "chance.hpp"
#include "surfaces.hpp"

namespace loopbit::town {
namespace {

constexpr std::array<Color, 8> kCarPaints{rgb(0.70F, 0.71F, 0.72F), rgb(0.16F, 0.17F, 0.19F),
                                          rgb(0.85F, 0.85F, 0.84F), rgb(0.56F, 0.13F, 0.12F),
                                          rgb(0.15F, 0.25F, 0.45F), rgb(0.35F, 0.37F, 0.39F),
                                          rgb(0.22F, 0.36F, 0.30F), rgb(0.72F, 0.62F, 0.28F)};
constexpr Color kCarGlass = rgb(0.16F, 0.19F, 0.22F);
constexpr Color kTyre = rgb(0.07F, 0.07F, 0.07F);
constexpr float kBelt_m = 0.95F;  // where a car's windows begin
constexpr float kWheel_m = 0.31F;

Color car_paint(const Prism& car) { return kCarPaints[car.detail % kCarPaints.size()]; }

float outline_height(const Prism& car, float v) {
  for (int i = 1; i < car.outline_size; ++i) {
    const OutlinePoint& a = car.outline[static_cast<std::size_t>(i - 1)];
    const OutlinePoint& b = car.outline[static_cast<std::size_t>(i)];
    if (v <= b.v && b.v > a.v) return blend(a.z, b.z, clamp01((v - a.v) / (b.v - a.v)));
  }
  return car.outline[static_cast<std::size_t>(car.outline_size - 1)].z;
}

Color wheel(Color color, float v, float z, float footprint) {
  const float radius = std::sqrt(v * v + (z - kWheel_m) * (z - kWheel_m));
  color = blend(color, gray(0.05F), cover(radius, -1.0F, kWheel_m + 0.06F, footprint));
  color = blend(color, kTyre, cover(radius, -1.0F, kWheel_m, footprint));
  return blend(color, gray(0.55F), cover(radius, -1.0F, 0.19F, footprint));
}

constexpr std::array<Color, 6> kSignPaints{rgb(0.70F, 0.10F, 0.10F), rgb(0.10F, 0.25F, 0.60F),
                                           rgb(0.85F, 0.70F, 0.10F), rgb(0.85F, 0.85F, 0.85F),
                                           rgb(0.10F, 0.40F, 0.20F), rgb(0.70F, 0.10F, 0.10F)};

/// Share of a pixel inside a disc or ellipse; radii in metres.
float disc(float x, float z, float radius_x, float radius_z, float footprint) {
  const float distance = std::sqrt(x * x / (radius_x * radius_x) + z * z / (radius_z * radius_z));
  return cover(distance, -1.0F, 1.0F, footprint / std::min(radius_x, radius_z));
}

float tree(const Billboard& board, float x, float z, float footprint, Color& color) {
  const float crown_low = board.height_m * 0.32F;
  const float half_high = (board.height_m - crown_low) / 2;
  const float trunk = cover(std::abs(x), -1.0F, 0.03F * board.height_m, footprint) *
                      cover(z, -1.0F, crown_low + half_high, footprint);
  const float clumps = value_noise(board.detail, x / 0.9F, z / 0.9F) +
                       0.5F * noise_of_size(board.detail + 1, x, z, 0.25F, footprint);
  const float dx = x / board.half_width_m;
  const float dz = (z - crown_low - half_high) / half_high;
  const float inside = 1.0F - std::sqrt(dx * dx + dz * dz) + 0.45F * clumps;
  float crown = clamp01(inside * 6.0F / std::max(1.0F, 20.0F * footprint));
  if (board.bare > 0) {
    const float twigs =
        unit(scramble(board.detail + 3)) + noise_of_size(board.detail + 4, x, z, 0.12F, footprint);
    crown *= clamp01(1.0F - 1.6F * board.bare + 0.6F * twigs * board.bare);
  }
  const float leaves =
      0.7F * noise_of_size(board.detail + 2, x, z, 0.13F, footprint) + 0.9F * clumps + 0.25F * dz;
  const float season = unit(scramble(board.detail));
  const Color green = blend(rgb(0.20F, 0.34F, 0.14F), rgb(0.38F, 0.40F, 0.15F), season);
  color = blend(rgb(0.28F, 0.22F, 0.17F), green * (0.95F + 0.6F * leaves), crown);
  return std::max(trunk, crown);
}

float lamp(const Billboard& board, float x, float z, float footprint, Color& color) {
  const float post =
      cover(x, -0.06F, 0.06F, footprint) * cover(z, -1.0F, board.height_m - 0.3F, footprint);
  const float foot = cover(x, -0.12F, 0.12F, footprint) * cover(z, -1.0F, 0.8F, footprint);
  const float globe = disc(x, z - board.height_m + 0.3F, 0.26F, 0.26F, footprint);
  color = blend(rgb(0.16F, 0.20F, 0.18F), rgb(0.88F, 0.87F, 0.82F), globe);
  return std::max(std::max(post, foot), globe);
}

float sign(const Billboard& board, float x, float z, float footprint, Color& color) {
  const float post = cover(x, -0.035F, 0.035F, footprint) * cover(z, -1.0F, 2.4F, footprint);
  const bool round = (board.detail & 8U) != 0;
  const float plate = round
                          ? disc(x, z - 2.4F, 0.34F, 0.34F, footprint)
                          : cover(x, -0.36F, 0.36F, footprint) * cover(z, 2.05F, 2.72F, footprint);
  const float inner = round
                          ? disc(x, z - 2.4F, 0.25F, 0.25F, footprint)
                          : cover(x, -0.30F, 0.30F, footprint) * cover(z, 2.11F, 2.66F, footprint);
  const Color paint = kSignPaints[(board.detail >> 4) % kSignPaints.size()];
  const float marks = glyphs(board.detail, x + 0.18F, z - 2.25F, 0.28F, footprint);
  Color face = blend(paint, gray(0.88F), (board.detail & 16U) != 0 ? inner : 0.12F * inner);
  face = blend(face, gray(0.1F), marks * inner);
  color = blend(gray(0.5F), face, plate);
  return std::max(post, plate);
}

float person(const Billboard& board, float x, float z, float footprint, Color& color) {
  Random random(board.detail);
  const float height = random.between(1.55F, 1.85F);
  const auto cloth = [&random] {  // braces keep the order of the calls, parentheses would not
    return blend(gray(0.35F), Color{random.uniform(), random.uniform(), random.uniform()}, 0.6F);
  };
  const Color coat = cloth();
  const Color trousers = cloth() * 0.5F;
  const Color skin = rgb(0.80F, 0.62F, 0.50F) * random.between(0.5F, 1.1F);
  const float step = board.phase + 6.0F * random.uniform();
  const float swing = 0.22F * (std::abs(wrap(step, 2.0F) - 1.0F) * 2.0F - 1.0F);
  const float hip = 0.48F * height;
  const float shoulder = 0.83F * height;
  const auto limb = [&](float foot, float half, float low, float high, float lean) {
    const float middle = foot + lean * clamp01((high - z) / (high - low));
    return cover(x, middle - half, middle + half, footprint) * cover(z, low, high, footprint);
  };
  const float legs =
      std::max(limb(0.05F, 0.08F, 0.0F, hip, swing), limb(-0.05F, 0.08F, 0.0F, hip, -swing));
  const float arms = std::max(limb(0.2F, 0.05F, hip, shoulder, -0.4F * swing),
                              limb(-0.2F, 0.05F, hip, shoulder, 0.4F * swing));
  const float chest = std::max(limb(0.0F, 0.15F, hip - 0.12F, shoulder - 0.08F, 0.0F),
                               disc(x, z - shoulder + 0.1F, 0.21F, 0.12F, footprint));
  const float body = std::max(chest, arms);
  const float head = disc(x, z - height + 0.12F, 0.095F, 0.13F, footprint);
  color = blend(blend(trousers, coat, clamp01(body * 2.0F)), skin, head);
  return std::max(std::max(legs, body), head);
}

}  // namespace

Color car_side_color(const Prism& car, float v, float z, float footprint) {
  const float half = car.v_max();
  const float top = outline_height(car, v);
  Color color = car_paint(car) * blend(0.8F, 1.05F, clamp01(z / 0.9F));
  color = blend(color, color * 0.6F, cover(v, -0.12F, -0.09F, footprint));
  color = blend(color, color * 0.6F, cover(v, 0.78F, 0.81F, footprint));
  color = blend(color, gray(0.2F), cover(z, 0.2F, 0.3F, footprint));
  const float window = cover(z, kBelt_m, top - 0.08F, footprint);
  const float pillar = cover(v, -0.14F, -0.04F, footprint);
  color = blend(color, kCarGlass, window * (1.0F - pillar));
  color = blend(color, kTyre, cover(z, -1.0F, 0.2F, footprint));
  color = wheel(color, v + half * 0.62F, z, footprint);
  return wheel(color, v - half * 0.64F, z, footprint);
}

Color car_end_color(const Prism& car, float u, float z, float footprint, bool nose) {
  const float x = std::abs(u);
  Color color = car_paint(car) * 0.9F;
  color = blend(color, gray(0.16F), cover(z, 0.25F, 0.42F, footprint));
  const float lamps = cover(x, 0.52F, 0.8F, footprint) *
                      (nose ? cover(z, 0.5F, 0.62F, footprint) : cover(z, 0.58F, 0.8F, footprint));
  color = blend(color, nose ? rgb(0.95F, 0.95F, 0.88F) : rgb(0.62F, 0.06F, 0.06F), lamps);
  const float plate = cover(x, -1.0F, 0.26F, footprint) * cover(z, 0.44F, 0.55F, footprint);
  const float marks = glyphs(car.detail, u + 0.22F, z - 0.46F, 0.07F, footprint);
  color = blend(color, blend(gray(0.88F), gray(0.1F), marks), plate);
  const bool tall = car.outline[0].z > 1.5F;
  if (tall && !nose) {
    color = blend(color, kCarGlass,
                  cover(z, 1.15F, 1.75F, footprint) * cover(x, 0.06F, 0.7F, footprint));
  }
  color = blend(color, kTyre, cover(z, -1.0F, 0.2F, footprint));
  return blend(color, kTyre, cover(z, -1.0F, 0.32F, footprint) * cover(x, 0.6F, 0.8F, footprint));
}

Color car_top_color(const Prism& car, float v, float footprint) {
  const float slope = outline_height(car, v + 0.05F) - outline_height(car, v - 0.05F);
  const float height = outline_height(car, v);
  const bool glass =
      std::abs(slope) > 0.045F && height > 1.02F && height < car.outline[3].z - 0.03F;
  const Color paint = car_paint(car) * 1.12F;
  if (!glass) return paint;
  return blend(paint, kCarGlass + gray(0.12F * height), resolved(0.8F, footprint));
}

Color plain_wall_color(std::uint32_t detail, float u, float z, float footprint) {
  constexpr Color kBare = rgb(0.60F, 0.60F, 0.59F);
  const float seam = cover(wrap(u, 4.0F), 0.0F, 0.02F, footprint);
  const float cloudy = 0.035F * noise_of_size(detail, u, z, 2.5F, footprint);
  return kBare * (1.0F + cloudy - 0.04F * seam - 0.06F * clamp01(1.0F - z));
}

Color hedge_color(std::uint32_t detail, float u, float z, float footprint) {
  const float leaves = 0.5F * noise_of_size(detail, u, z, 0.3F, footprint) +
                       0.6F * noise_of_size(detail + 1, u, z, 0.07F, footprint);
  return rgb(0.22F, 0.34F, 0.16F) * (0.75F + 0.25F * z + leaves);
}

Color chimney_color(const HouseStyle& style, float u, float z, float footprint) {
  const float joint = cover(wrap(z, 0.15F), 0.0F, 0.03F, footprint) * resolved(0.15F, footprint);
  const Color brick = blend(style.roof, rgb(0.5F, 0.32F, 0.26F), 0.7F);
  return brick * (0.95F - 0.3F * joint + 0.3F * noise_of_size(style.seed, u, z, 0.2F, footprint));
}

Color roof_color(const HouseStyle& style, float u, float v, float footprint) {
  constexpr float kTile_m = 0.28F;
  const float fade = resolved(kTile_m, footprint);
  const float own =
      unit(hash_of(style.seed + 21, floor_int(u / kTile_m), floor_int(v / kTile_m))) - 0.5F;
  const float step = cover(wrap(v, kTile_m), 0.0F, 0.07F, footprint);
  const float moss = 0.3F * noise_of_size(style.seed + 22, u, v, 1.2F, footprint);
  return style.roof * (1.0F + fade * (0.35F * own - 0.4F * step) + moss);
}

Color in_snow(Color color, std::uint32_t seed, float x, float y, float season) {
  constexpr float kMostSnow = 0.6F;  // a closed cover would have fewer edges than half of one
  const float patch = value_noise(seed, x / 1.7F, y / 1.7F) + 0.5F;
  const Color wet = color * (1.0F - 0.35F * season);
  return blend(wet, gray(0.85F), 0.9F * clamp01((kMostSnow * season - patch) * 4.0F));
}

float glyphs(std::uint32_t seed, float x, float y, float height_m, float footprint) {
  constexpr float kColumns = 3.0F;
  constexpr float kRows = 5.0F;
  constexpr float kMeanInk = 0.3F;
  const float advance = height_m * 0.85F;
  const int letter = floor_int(x / advance);
  const int letters = 3 + static_cast<int>(seed % 9);
  if (y < 0 || y >= height_m || letter < 0 || letter >= letters) return 0.0F;
  const float in_letter = (x / advance - static_cast<float>(letter)) / 0.8F;
  if (in_letter >= 1.0F) return 0.0F;
  const int cell = floor_int(in_letter * kColumns) + 3 * floor_int(y / height_m * kRows);
  const std::uint32_t strokes = hash_of(seed, letter);
  const float ink = ((strokes >> (cell + 8)) & 1U) != 0 ? 1.0F : 0.0F;
  return blend(kMeanInk, ink, resolved(height_m / kRows, footprint));
}

float billboard_color(const Billboard& board, float x, float z, float footprint, Color& color) {
  switch (board.shape) {
    case Shape::lamp:
      return lamp(board, x, z, footprint, color);
    case Shape::sign:
      return sign(board, x, z, footprint, color);
    case Shape::person:
      return person(board, x, z, footprint, color);
    case Shape::tree:
      break;
  }
  return tree(board, x, z, footprint, color);
}

}  // namespace loopbit::town
