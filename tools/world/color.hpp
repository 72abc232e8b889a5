// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "chance.hpp"

namespace loopbit::town {

/// In the order OpenCV stores it; 1 is the white of the sensor.
struct Color {
  float b = 0.0F;
  float g = 0.0F;
  float r = 0.0F;
};

constexpr Color rgb(float r, float g, float b) { return {b, g, r}; }
constexpr Color gray(float value) { return {value, value, value}; }

constexpr Color operator+(Color a, Color b) { return {a.b + b.b, a.g + b.g, a.r + b.r}; }
constexpr Color operator*(Color a, Color b) { return {a.b * b.b, a.g * b.g, a.r * b.r}; }
constexpr Color operator*(Color a, float s) { return {a.b * s, a.g * s, a.r * s}; }

constexpr Color blend(Color a, Color b, float share) {
  return {blend(a.b, b.b, share), blend(a.g, b.g, share), blend(a.r, b.r, share)};
}

/// Share of a pixel of width `footprint` at x that lies in low..high, 0 to 1.
inline float cover(float x, float low, float high, float footprint) {
  const float scale = 1.0F / std::max(footprint, 1e-4F);
  return clamp01((x - low) * scale + 0.5F) - clamp01((x - high) * scale + 0.5F);
}

/// Visible contrast of a detail of the given size in a pixel of width `footprint`.
constexpr float resolved(float size, float footprint) {
  return clamp01(1.6F - footprint * (1.6F / size));
}

/// Noise of mean 0, in about [-0.5, 0.5], with bends of 1 in x and y.
inline float value_noise(std::uint32_t seed, float x, float y) {
  const int ix = floor_int(x);
  const int iy = floor_int(y);
  const auto corner = [seed](int a, int b) {  // one round of scramble(): smoothing hides the rest
    std::uint32_t h = (static_cast<std::uint32_t>(a) * 0x9e3779b9U) ^
                      (static_cast<std::uint32_t>(b) * 0x85ebca6bU + seed);
    h ^= h >> 15;
    return unit(h * 0x7feb352dU);
  };
  const float fx = smooth_step(x - static_cast<float>(ix));
  const float fy = smooth_step(y - static_cast<float>(iy));
  return blend(blend(corner(ix, iy), corner(ix + 1, iy), fx),
               blend(corner(ix, iy + 1), corner(ix + 1, iy + 1), fx), fy) -
         0.5F;
}

/// value_noise of bends of `size`, faded out where a pixel sees more than one of them.
inline float noise_of_size(std::uint32_t seed, float x, float y, float size, float footprint) {
  const float left = resolved(size, footprint);
  const float bends = 1.0F / size;
  return left > 0 ? left * value_noise(seed, x * bends, y * bends) : 0.0F;
}

}  // namespace loopbit::town
