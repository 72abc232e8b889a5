// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <array>

#include "chance.hpp"
#include "surfaces.hpp"

namespace loopbit::town {
namespace {

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
  const float crown = clamp01(inside * 6.0F / std::max(1.0F, 20.0F * footprint));
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
