// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "drive.hpp"

#include <numbers>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kLane_m = 1.6;         // right of the centre line, first lap
constexpr double kWander_m = 0.3;       // from end to end
constexpr double kWanderLength_m = 14;  // between two bends of the steering
constexpr double kDrift_m = 25;         // driven between the line of the first lap and the next
constexpr std::uint32_t kWanderSalt = 0x3a4dU;

}  // namespace

Drive::Drive(const WorldOptions& options, const Circuit& circuit)
    : circuit_(circuit),
      seed_(static_cast<std::uint32_t>(options.seed)),
      spacing_m_(options.spacing_m),
      lateral_offset_m_(options.lateral_offset_m),
      reverse_second_(options.reverse_second_lap) {}

int Drive::lap(int frame) const { return floor_int(driven_m(frame) / circuit_.length_m()); }

double Drive::along_m(int frame) const {
  return reversed(frame) ? -driven_m(frame) : driven_m(frame);
}

bool Drive::blank(int frame) const { return circuit_.blank_at(along_m(frame)); }

// After the first lap the camera moves to its new line gradually.
double Drive::left_m(int lap, bool reversed, double driven_m) const {
  double line = -kLane_m;
  if (lap > 0) {
    const double since = (driven_m - circuit_.length_m()) / kDrift_m;
    line += lateral_offset_m_ * smooth_step(clamp01(static_cast<float>(since)));
  }
  const double wander = smooth_noise(seed_ ^ kWanderSalt, driven_m / kWanderLength_m) - 0.5;
  return (reversed ? -line : line) + kWander_m * wander;
}

double Drive::left_m(int frame) const {
  return left_m(lap(frame), reversed(frame), driven_m(frame));
}

StreetPoint Drive::camera(int frame) const {
  constexpr double kStep_m = 0.5;
  StreetPoint point = ahead(frame, 0.0, left_m(frame));
  const auto left = [&](double step_m) {
    return left_m(lap(frame), reversed(frame), driven_m(frame) + step_m);
  };
  point.heading_rad +=
      (left(kStep_m) - left(-kStep_m)) / (2 * kStep_m);  // small, so no arc tangent
  return point;
}

StreetPoint Drive::ahead(int frame, double ahead_m, double left_m) const {
  if (!reversed(frame)) return circuit_.at(along_m(frame) + ahead_m, left_m);
  StreetPoint point = circuit_.at(along_m(frame) - ahead_m, -left_m);
  point.heading_rad += std::numbers::pi;
  return point;
}

}  // namespace loopbit::town
