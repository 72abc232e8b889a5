// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

// Chance and trigonometry that give the same bits on every machine: only integers and the
// operations that IEEE 754 rounds exactly. std:: distributions and std::sin do not.
namespace loopbit::town {

constexpr std::uint32_t scramble(std::uint32_t h) {  // "lowbias32" of C. Wellons' hash prospector
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
  return h ^ (h >> 16);
}

constexpr std::uint32_t hash_of(std::uint32_t seed, int a, int b = 0) {
  return scramble(scramble(seed + static_cast<std::uint32_t>(a) * 0x9e3779b9U) ^
                  (static_cast<std::uint32_t>(b) * 0x85ebca6bU + 0x165667b1U));
}

/// In [0, 1).
constexpr float unit(std::uint32_t hash) { return static_cast<float>(hash >> 8) * 0x1p-24F; }

/// A sequence of numbers from one hash.
class Random {
 public:
  explicit Random(std::uint32_t seed) : state_(seed) {}

  std::uint32_t bits() { return scramble(state_ += 0x9e3779b9U); }
  float uniform() { return unit(bits()); }
  float between(float low, float high) { return low + (high - low) * uniform(); }
  bool chance(float share) { return uniform() < share; }
  int pick(int count) { return static_cast<int>(uniform() * static_cast<float>(count)); }

 private:
  std::uint32_t state_;
};

/// floor(x), for |x| < 2^31; several times faster than std::floor where the compiler has to call
/// it.
template <typename Real>
constexpr int floor_int(Real x) {
  const int whole = static_cast<int>(x);
  return whole - (x < static_cast<Real>(whole) ? 1 : 0);
}

/// x less the whole periods in it.
constexpr float wrap(float x, float period) {
  return x - period * static_cast<float>(floor_int(x * (1.0F / period)));
}

constexpr float blend(float a, float b, float share) { return a + (b - a) * share; }
constexpr float clamp01(float x) { return std::clamp(x, 0.0F, 1.0F); }
constexpr float smooth_step(float x) { return x * x * (3.0F - 2.0F * x); }

/// A mean of 0.5, one bend a unit of x.
inline float smooth_noise(std::uint32_t seed, double x) {
  const int cell = floor_int(x);
  const auto in_cell = static_cast<float>(x - cell);
  return blend(unit(hash_of(seed, cell)), unit(hash_of(seed, cell + 1)), smooth_step(in_cell));
}

struct SinCos {
  double sin = 0.0;
  double cos = 1.0;
};

/// Taylor series after reduction to a quarter turn; error below 1e-11 for |angle| < 1e3.
inline SinCos sin_cos(double angle) {
  const double quarters = std::floor(angle / (std::numbers::pi / 2) + 0.5);
  const double x = angle - quarters * (std::numbers::pi / 2);
  const double q = x * x;
  const double s =
      x * (1 - q / 6 * (1 - q / 20 * (1 - q / 42 * (1 - q / 72 * (1 - q / 110 * (1 - q / 156))))));
  const double c =
      1 - q / 2 * (1 - q / 12 * (1 - q / 30 * (1 - q / 56 * (1 - q / 90 * (1 - q / 132)))));
  const int quadrant = static_cast<int>(quarters - 4 * std::floor(quarters / 4));
  constexpr std::array<std::array<int, 2>, 4> kSign{{{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}};
  const auto& sign = kSign[static_cast<std::size_t>(quadrant)];
  const bool swapped = quadrant % 2 == 1;
  return {sign[0] * (swapped ? c : s), sign[1] * (swapped ? s : c)};
}

}  // namespace loopbit::town
