// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "light.hpp"

#include <array>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr std::uint32_t kLightSalt = 0x11447U;

constexpr Light kMorning{.azimuth_rad = 0.62,
                         .rise = 1.15,
                         .to_sun = {},
                         .sun = rgb(0.62F, 0.60F, 0.55F),
                         .ambient = rgb(0.47F, 0.49F, 0.54F),
                         .sky_top = rgb(0.32F, 0.52F, 0.82F),
                         .sky_low = rgb(0.74F, 0.82F, 0.90F),
                         .cloud = rgb(0.95F, 0.95F, 0.95F),
                         .lamp = {},
                         .cloud_cover = 0.42F,
                         .cloud_shift = 0.0F};
constexpr Light kEvening{.azimuth_rad = 3.75,
                         .rise = 0.52,
                         .to_sun = {},
                         .sun = rgb(0.70F, 0.50F, 0.28F),
                         .ambient = rgb(0.33F, 0.32F, 0.37F),
                         .sky_top = rgb(0.34F, 0.42F, 0.62F),
                         .sky_low = rgb(0.93F, 0.76F, 0.56F),
                         .cloud = rgb(0.88F, 0.66F, 0.54F),
                         .lamp = {},
                         .cloud_cover = 0.5F,
                         .cloud_shift = 37.0F};
constexpr Light kOvercast{.azimuth_rad = 2.1,
                          .rise = 1.3,
                          .to_sun = {},
                          .sun = rgb(0.07F, 0.07F, 0.07F),
                          .ambient = rgb(0.54F, 0.57F, 0.61F),
                          .sky_top = rgb(0.55F, 0.59F, 0.64F),
                          .sky_low = rgb(0.74F, 0.76F, 0.78F),
                          .cloud = rgb(0.66F, 0.68F, 0.70F),
                          .lamp = {},
                          .cloud_cover = 0.85F,
                          .cloud_shift = 81.0F};
constexpr Light kNoon{.azimuth_rad = 5.4,
                      .rise = 1.8,
                      .to_sun = {},
                      .sun = rgb(0.72F, 0.71F, 0.68F),
                      .ambient = rgb(0.42F, 0.45F, 0.50F),
                      .sky_top = rgb(0.24F, 0.46F, 0.80F),
                      .sky_low = rgb(0.66F, 0.79F, 0.92F),
                      .cloud = rgb(1.0F, 1.0F, 1.0F),
                      .lamp = {},
                      .cloud_cover = 0.25F,
                      .cloud_shift = 123.0F};
constexpr std::array<Light, 4> kLights{kMorning, kEvening, kOvercast, kNoon};

Light own_light(std::uint32_t seed, int lap) {
  if (lap < static_cast<int>(kLights.size())) return kLights[static_cast<std::size_t>(lap)];
  Light light = kLights[hash_of(seed ^ kLightSalt, lap) % kLights.size()];
  light.cloud_shift += static_cast<float>(lap % 1000);
  return light;
}

Light between(const Light& a, const Light& b, double share) {
  const auto part = static_cast<float>(share);
  Light mixed;
  mixed.azimuth_rad = a.azimuth_rad + (b.azimuth_rad - a.azimuth_rad) * share;
  mixed.rise = a.rise + (b.rise - a.rise) * share;
  mixed.sun = blend(a.sun, b.sun, part);
  mixed.ambient = blend(a.ambient, b.ambient, part);
  mixed.sky_top = blend(a.sky_top, b.sky_top, part);
  mixed.sky_low = blend(a.sky_low, b.sky_low, part);
  mixed.cloud = blend(a.cloud, b.cloud, part);
  mixed.cloud_cover = blend(a.cloud_cover, b.cloud_cover, part);
  mixed.cloud_shift = blend(a.cloud_shift, b.cloud_shift, part);
  return mixed;
}

void darken(Light& light, float night) {
  light.sun = light.sun * (1.0F - night);
  light.ambient = light.ambient * (1.0F - 0.92F * night);
  light.sky_top = blend(light.sky_top, rgb(0.02F, 0.02F, 0.04F), night);
  light.sky_low = blend(light.sky_low, rgb(0.05F, 0.05F, 0.06F), night);
  light.cloud = blend(light.cloud, rgb(0.06F, 0.06F, 0.07F), night);
  light.lamp = rgb(1.0F, 0.82F, 0.55F) * night;
}

std::size_t slot_of(const LotKey& key) {
  return hash_of(hash_of(0, key.block.x, key.block.y), key.side, key.number) % kMemorySlots;
}

}  // namespace

Light light_of_lap(std::uint32_t seed, int lap, double change, float night) {
  Light light = between(kMorning, own_light(seed, lap), change);
  if (night > 0) darken(light, night);
  const auto [sin, cos] = sin_cos(light.azimuth_rad);
  light.to_sun = {cos, sin};
  return light;
}

Color sky_color(const Light& light, Vec2 direction, float rise) {
  constexpr float kCloudLift = 0.12F;  // keeps clouds at the horizon from becoming infinitely thin
  const Color clear = blend(light.sky_low, light.sky_top, clamp01(rise * 1.6F));
  const float scale = 1.1F / (rise + kCloudLift);
  const float x = static_cast<float>(direction.x) * scale + light.cloud_shift;
  const float y = static_cast<float>(direction.y) * scale;
  const float thickness = value_noise(1, x, y) + 0.5F * value_noise(2, x * 2.3F, y * 2.3F) +
                          0.25F * value_noise(3, x * 5.1F, y * 5.1F);
  const float cover = clamp01((thickness + light.cloud_cover - 0.5F) * 2.5F + 0.5F);
  const float haze = clamp01(rise * 5.0F);
  return blend(clear, light.cloud * (1.0F - 0.15F * cover * thickness), cover * haze);
}

Shadows::Shadows(const Town& town, const Light& light)
    : town_(town), to_sun_(light.to_sun), rise_(light.rise), memory_(kMemorySlots) {}

float Shadows::top_m(const LotKey& key) {
  if (last_.top_m >= 0 && last_.key == key) return last_.top_m;
  Memory& memory = memory_[slot_of(key)];
  if (memory.top_m < 0 || !(memory.key == key)) memory = {key, town_.top_m(key)};
  last_ = memory;
  return memory.top_m;
}

float Shadows::height_at(Vec2 point) {
  double distance_m = 0.0;
  const LotKey key = town_.first_lot(point, to_sun_, distance_m);
  return top_m(key) - static_cast<float>(distance_m * rise_);
}

}  // namespace loopbit::town
