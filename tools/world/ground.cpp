// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "chance.hpp"
#include "surfaces.hpp"

namespace loopbit::town {
namespace {

constexpr Color kAsphalt = rgb(0.36F, 0.36F, 0.37F);
constexpr Color kPaint = rgb(0.80F, 0.80F, 0.77F);
constexpr Color kSlab = rgb(0.57F, 0.55F, 0.52F);
constexpr Color kCurb = rgb(0.66F, 0.65F, 0.63F);
constexpr Color kGarden = rgb(0.36F, 0.40F, 0.24F);

/// A point of a street: metres along it, and across from its centre line. pixel_* are footprints.
struct StreetSpot {
  std::uint32_t street = 0;
  float along = 0.0F;
  float across = 0.0F;
  float pixel_along = 0.0F;
  float pixel_across = 0.0F;
  float half_length = 0.0F;  // from the middle of the street to the crossings' edges

  [[nodiscard]] float pixel() const { return std::max(pixel_along, pixel_across); }
};

Color asphalt(std::uint32_t seed, float x, float y, float pixel) {
  const float stain = noise_of_size(seed + 2, x, y, 2.7F, pixel);
  const float grain = 0.22F * noise_of_size(seed, x, y, 0.05F, pixel) +
                      0.16F * noise_of_size(seed + 1, x, y, 0.4F, pixel) + 0.2F * stain;
  const Color color = kAsphalt * (1.0F + grain);
  const float broken = clamp01(4.0F * stain) * resolved(0.10F, pixel);  // light old road cracks
  if (broken <= 0) return color;
  const float vein =
      value_noise(seed + 3, x / 1.7F, y / 1.7F) + 0.35F * value_noise(seed + 4, x / 0.4F, y / 0.4F);
  const float crack = cover(vein, -0.006F, 0.006F, 0.012F + 0.5F * pixel);
  return color * (1.0F - 0.5F * broken * crack);
}

// Square patches of repaired road.
Color patches(Color color, std::uint32_t seed, float x, float y, float pixel) {
  constexpr float kCell_m = 5.0F;
  const int cx = floor_int(x / kCell_m);
  const int cy = floor_int(y / kCell_m);
  const std::uint32_t hash = hash_of(seed + 9, cx, cy);
  if ((hash & 3U) != 0) return color;
  const float px = wrap(x, kCell_m);
  const float py = wrap(y, kCell_m);
  const float wide = 0.8F + 2.5F * unit(scramble(hash));
  const float high = 0.6F + 2.0F * unit(scramble(hash + 1));
  const float shade = unit(scramble(hash + 2)) < 0.6F ? 0.72F : 1.2F;
  return color * blend(1.0F, shade,
                       cover(px, 0.8F, 0.8F + wide, pixel) * cover(py, 0.7F, 0.7F + high, pixel));
}

Color manhole(Color color, const StreetSpot& spot) {
  constexpr float kEvery_m = 11.0F;
  const int number = floor_int(spot.along / kEvery_m);
  const std::uint32_t hash = hash_of(spot.street + 5, number);
  const float x = spot.across - (unit(hash) * 5.0F - 2.5F);
  const float y = wrap(spot.along, kEvery_m) - 1.0F - 9.0F * unit(scramble(hash));
  const float radius = std::sqrt(x * x + y * y);
  if (radius > 0.5F) return color;
  color = blend(color, gray(0.25F), cover(radius, -1.0F, 0.38F, spot.pixel()));
  return blend(color, gray(0.5F), cover(radius, 0.26F, 0.31F, spot.pixel()));
}

Color markings(Color color, const StreetSpot& spot) {
  const float to_end = spot.half_length - std::abs(spot.along);
  float paint = 0.0F;
  if (to_end > 4.5F) {
    const float dash = cover(wrap(spot.along, 6.0F), 0.0F, 3.0F, spot.pixel_along);
    paint = dash * cover(spot.across, -0.06F, 0.06F, spot.pixel_across);
    const float edge =
        cover(std::abs(spot.across), kLaneEdge_m - 0.05F, kLaneEdge_m + 0.05F, spot.pixel_across);
    paint = std::max(paint, edge * (wrap(spot.along, 1.4F) < 0.7F ? 1.0F : 0.3F));
  } else {
    const float stripe = cover(wrap(spot.across, 1.0F), 0.0F, 0.5F, spot.pixel_across);
    paint = cover(to_end, 1.0F, 3.6F, spot.pixel_along) * stripe;
  }
  const float wear =
      0.75F + 0.5F * noise_of_size(spot.street, spot.along, spot.across, 0.3F, spot.pixel());
  return blend(color, kPaint, paint * clamp01(wear));
}

Color pavement(std::uint32_t seed, float x, float y, float pixel) {
  constexpr float kSize_m = 0.6F;
  const int column = floor_int(x / kSize_m);
  const int row = floor_int(y / kSize_m);
  const float fade = resolved(kSize_m, pixel);
  const float own = (unit(hash_of(seed + 11, column, row)) - 0.5F) * fade;
  const float joint = std::max(cover(wrap(x, kSize_m), 0.0F, 0.03F, pixel),
                               cover(wrap(y, kSize_m), 0.0F, 0.03F, pixel));
  const float stain = 0.22F * noise_of_size(seed + 12, x, y, 0.7F, pixel) +
                      0.12F * noise_of_size(seed + 13, x, y, 0.07F, pixel);
  return kSlab * (1.0F + 0.2F * own + stain - 0.35F * joint * fade);
}

Color street(const StreetSpot& spot, std::uint32_t seed, float x, float y) {
  const float off_kerb = std::abs(spot.across) - kKerb_m;
  if (off_kerb > 0.2F) return pavement(seed, x, y, spot.pixel());
  Color color = patches(asphalt(seed, x, y, spot.pixel()), seed, x, y, spot.pixel());
  color = markings(manhole(color, spot), spot);
  color = blend(color, color * 0.7F, cover(off_kerb, -0.25F, 0.0F, spot.pixel_across));
  return blend(color, kCurb, cover(off_kerb, 0.0F, 0.5F, spot.pixel_across));
}

float from_street(double value, double pitch_m) {
  return static_cast<float>(value - pitch_m * floor_int(value / pitch_m + 0.5));
}

}  // namespace

Color bare_ground_color(std::uint32_t seed, Vec2 at, double pitch_m, float footprint) {
  const float x = from_street(at.x, pitch_m);
  const float y = from_street(at.y, pitch_m);
  const float grain = 0.06F * noise_of_size(seed, x, y, 0.05F, footprint) +
                      0.04F * noise_of_size(seed + 1, x, y, 2.7F, footprint);
  const bool carriageway = std::min(std::abs(x), std::abs(y)) < kKerb_m;
  return (carriageway ? kAsphalt : kSlab * 0.9F) * (1.0F + grain);
}

Color ground_color(std::uint32_t seed, Vec2 at, double pitch_m, float footprint_x,
                   float footprint_y) {
  const int line_x = floor_int(at.x / pitch_m + 0.5);
  const int line_y = floor_int(at.y / pitch_m + 0.5);
  const auto off_x = static_cast<float>(at.x - line_x * pitch_m);
  const auto off_y = static_cast<float>(at.y - line_y * pitch_m);
  const bool on_x = std::abs(off_x) < kFront_m;  // a street that runs north
  const bool on_y = std::abs(off_y) < kFront_m;
  const std::uint32_t here = hash_of(seed, line_x, line_y);
  // Coordinates from the nearest crossing: exact in float however large the town.
  const float x = off_x;
  const float y = off_y;
  const float pixel = std::max(footprint_x, footprint_y);
  if (!on_x && !on_y) {
    return kGarden * (1.0F + 0.5F * noise_of_size(here, x, y, 0.5F, pixel));
  }
  if (on_x && on_y) {
    const bool corner = std::abs(off_x) > kKerb_m && std::abs(off_y) > kKerb_m;
    if (corner) return pavement(here, x, y, pixel);
    return patches(asphalt(here, x, y, pixel), here, x, y, pixel);
  }
  StreetSpot spot;
  const auto half = static_cast<float>(pitch_m / 2);
  spot.half_length = half - static_cast<float>(kFront_m);
  spot.street = hash_of(here, on_x ? 1 : 2);
  const float along = on_x ? off_y : off_x;
  spot.along = along > 0 ? along - half : along + half;
  spot.across = on_x ? off_x : off_y;
  spot.pixel_along = on_x ? footprint_y : footprint_x;
  spot.pixel_across = on_x ? footprint_x : footprint_y;
  return street(spot, here, x, y);
}

}  // namespace loopbit::town
