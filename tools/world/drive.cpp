// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "drive.hpp"

#include <algorithm>
#include <numbers>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kLane_m = 1.6;         // right of the centre line, first lap
constexpr double kWander_m = 0.3;       // from end to end
constexpr double kWanderLength_m = 14;  // between two bends of the steering
constexpr double kDrift_m = 25;         // driven between the line of the first lap and the next
constexpr double kStorey_m = 3;
constexpr double kRamp_m = 30;  // the last metres on each floor
constexpr std::uint32_t kWanderSalt = 0x3a4dU;

}  // namespace

Drive::Drive(const WorldOptions& options, const Circuit& circuit)
    : circuit_(circuit),
      seed_(static_cast<std::uint32_t>(options.seed)),
      spacing_m_(options.spacing_m),
      lateral_offset_m_(options.lateral_offset_m),
      floors_(options.floors),
      floor_m_(options.laps * circuit.length_m()),
      reverse_second_(options.reverse_second_lap) {}

int Drive::floor(int frame) const {
  return floors_ == 1 ? 0 : std::min(floors_ - 1, floor_int(driven_m(frame) / floor_m_));
}

double Drive::on_floor_m(int frame) const { return driven_m(frame) - floor(frame) * floor_m_; }

int Drive::lap(int frame) const { return floor_int(driven_m(frame) / circuit_.length_m()); }

bool Drive::on_ramp(int frame) const {
  return floor(frame) < floors_ - 1 && on_floor_m(frame) > floor_m_ - kRamp_m;
}

double Drive::height_m(int frame) const {
  const int floor = this->floor(frame);
  if (!on_ramp(frame)) return kStorey_m * floor;
  const double on_ramp = (on_floor_m(frame) - (floor_m_ - kRamp_m)) / kRamp_m;
  const auto share = static_cast<double>(smooth_step(clamp01(static_cast<float>(on_ramp))));
  return kStorey_m * (floor + share);
}

double Drive::along_m(int frame) const {
  return reversed(frame) ? -driven_m(frame) : driven_m(frame);
}

bool Drive::blank(int frame) const { return on_ramp(frame) || circuit_.blank_at(along_m(frame)); }

// After the first lap the camera moves to its new line gradually, and back on the next floor.
double Drive::line_m(int frame, double ahead_m) const {
  const double on_floor_m = this->on_floor_m(frame) + ahead_m;
  const auto moved = [](double since_m) {
    return smooth_step(clamp01(static_cast<float>(since_m / kDrift_m)));
  };
  double line = -kLane_m;
  if (floor_int(this->on_floor_m(frame) / circuit_.length_m()) > 0) {
    line += lateral_offset_m_ * moved(on_floor_m - circuit_.length_m());
  } else if (floor(frame) > 0 && floor_m_ > circuit_.length_m()) {
    line += lateral_offset_m_ * (1 - moved(on_floor_m));
  }
  const double wander =
      smooth_noise(seed_ ^ kWanderSalt, (driven_m(frame) + ahead_m) / kWanderLength_m) - 0.5;
  return (reversed(frame) ? -line : line) + kWander_m * wander;
}

double Drive::left_m(int frame) const { return line_m(frame, 0); }

StreetPoint Drive::camera(int frame) const {
  constexpr double kStep_m = 0.5;
  StreetPoint point = ahead(frame, 0.0, left_m(frame));
  point.heading_rad += (line_m(frame, kStep_m) - line_m(frame, -kStep_m)) /
                       (2 * kStep_m);  // small, so no arc tangent
  return point;
}

StreetPoint Drive::ahead(int frame, double ahead_m, double left_m) const {
  if (!reversed(frame)) return circuit_.at(along_m(frame) + ahead_m, left_m);
  StreetPoint point = circuit_.at(along_m(frame) - ahead_m, -left_m);
  point.heading_rad += std::numbers::pi;
  return point;
}

}  // namespace loopbit::town
