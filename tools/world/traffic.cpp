// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "traffic.hpp"

#include <algorithm>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kParkingLine_m = 4.55;
constexpr double kParkingSlot_m = 5.6;
constexpr float kParkedShare = 0.34F;
constexpr double kOncomingSlot_m = 32.0;
constexpr double kOncomingStep_m = 0.8;  // a frame: 8 m/s
constexpr double kPassing_m = 3.3;       // between the middles of two cars that meet
constexpr double kFreeLane_m = 2.7;      // keeps clear of parked cars
constexpr double kLeaderNearest_m = 9.0;
constexpr double kLeaderFrames = 55.0;  // between two changes of its mind
constexpr double kPavement_m = 6.6;
constexpr double kPersonSlot_m = 8.0;
constexpr double kPersonStep_m = 0.13;  // a frame: 1.3 m/s

constexpr std::uint32_t kParkedSalt = 0x9a4cedU;
constexpr std::uint32_t kOncomingSalt = 0x0c0aU;
constexpr std::uint32_t kLeaderSalt = 0x1eadU;
constexpr std::uint32_t kPersonSalt = 0x9e09U;

using Outline = std::array<OutlinePoint, Prism::kMaxOutline>;

// From tail to nose: a saloon, a hatchback, a van. The repeated last points pad.
constexpr std::array<Outline, 3> kCars{{
    {{{-2.15F, 0.86F},
      {-2.0F, 0.96F},
      {-1.45F, 1.0F},
      {-0.85F, 1.42F},
      {0.35F, 1.42F},
      {1.05F, 0.98F},
      {2.0F, 0.82F},
      {2.15F, 0.62F}}},
    {{{-1.85F, 0.9F},
      {-1.8F, 1.0F},
      {-1.35F, 1.46F},
      {-0.5F, 1.5F},
      {0.35F, 1.46F},
      {1.0F, 1.02F},
      {1.75F, 0.88F},
      {1.9F, 0.64F}}},
    {{{-2.4F, 1.95F},
      {-2.3F, 2.05F},
      {0.0F, 2.08F},
      {0.9F, 2.04F},
      {1.3F, 1.7F},
      {1.7F, 1.12F},
      {2.3F, 0.95F},
      {2.4F, 0.66F}}},
}};

Vec2 unit_vector(double angle) {
  const auto [sin, cos] = sin_cos(angle);
  return {cos, sin};
}

// left_of(axis) is the direction in which the car points.
Prism make_car(Vec2 at, Vec2 forward, std::uint32_t detail) {
  Random random(detail);
  Prism car;
  car.wall = Wall::car;
  car.centre = at;
  car.axis = left_of(forward) * -1.0;
  car.half_length_m = 0.86F;
  const float kind = random.uniform();
  car.outline = kCars[kind < 0.45F ? 0 : kind < 0.85F ? 1 : 2];
  car.outline_size = Prism::kMaxOutline;
  car.detail = detail;
  return car;
}

}  // namespace

Traffic::Traffic(std::uint32_t seed, const Circuit& circuit, const Drive& drive, double busy)
    : seed_(seed), circuit_(circuit), drive_(drive), busy_(busy) {}

void Traffic::add_to(int frame, Scene& scene) const {
  const Vec2 eye = drive_.camera(frame).at;
  add_parked(frame, eye, scene);
  if (busy_ <= 0) return;
  add_oncoming(frame, scene);
  add_leader(frame, scene);
  add_people(frame, 1, scene);
  add_people(frame, -1, scene);
}

void Traffic::add_parked_along(GridPoint from, Vec2 along, int lap, Vec2 eye, Scene& scene) const {
  const double pitch = circuit_.pitch_m();
  const Vec2 begin = Vec2{from.x * pitch, from.y * pitch} + along * (kFront_m + 4.0);
  const int slots = floor_int((pitch - 2 * kFront_m - 8.0) / kParkingSlot_m) + 1;
  const std::uint32_t street = hash_of(seed_ ^ kParkedSalt, from.x, from.y);
  for (int slot = 0; slot < 2 * slots; ++slot) {
    std::uint32_t detail = hash_of(street, slot, along.x > 0 ? 1 : 0);
    if (unit(scramble(detail ^ static_cast<std::uint32_t>(lap))) < busy_) {
      detail = hash_of(detail, lap);
    }
    if (unit(scramble(detail)) > kParkedShare) continue;
    const double side = slot < slots ? 1.0 : -1.0;
    const Vec2 at = begin + along * ((slot % slots) * kParkingSlot_m) +
                    left_of(along) * (side * kParkingLine_m);
    if (dot(at - eye, at - eye) > kBillboardView_m * kBillboardView_m) continue;
    if (circuit_.blank_near(at, kBlankReach_m)) continue;
    scene.prisms.push_back(make_car(at, along * -side, detail));
  }
}

void Traffic::add_parked(int frame, Vec2 eye, Scene& scene) const {
  const double pitch = circuit_.pitch_m();
  const int reach = floor_int(kBillboardView_m / pitch) + 1;
  const GridPoint here{floor_int(eye.x / pitch), floor_int(eye.y / pitch)};
  const int lap = drive_.lap(frame);
  for (int y = here.y - reach; y <= here.y + reach; ++y) {
    for (int x = here.x - reach; x <= here.x + reach; ++x) {
      add_parked_along({x, y}, {1, 0}, lap, eye, scene);
      add_parked_along({x, y}, {0, 1}, lap, eye, scene);
    }
  }
}

// Slots are numbered over the whole drive, so traffic never repeats.
void Traffic::add_oncoming(int frame, Scene& scene) const {
  const double camera_left = drive_.left_m(frame);
  const double left = std::clamp(camera_left + (camera_left > 0 ? -kPassing_m : kPassing_m),
                                 -kFreeLane_m, kFreeLane_m);
  const double closed_in = drive_.driven_m(frame) + frame * kOncomingStep_m;
  const int first = floor_int((closed_in - kOncomingSlot_m) / kOncomingSlot_m);
  const int last = floor_int((closed_in + kBillboardView_m) / kOncomingSlot_m);
  for (int slot = first; slot <= last; ++slot) {
    const std::uint32_t detail = hash_of(seed_ ^ kOncomingSalt, slot);
    if (unit(scramble(detail)) >= busy_) continue;
    const double ahead = (slot + 0.7 * unit(detail)) * kOncomingSlot_m - closed_in;
    const StreetPoint at = drive_.ahead(frame, ahead, left);
    scene.prisms.push_back(make_car(at.at, unit_vector(at.heading_rad) * -1.0, detail));
  }
}

// One car ahead of the camera, at varying distance.
void Traffic::add_leader(int frame, Scene& scene) const {
  const double mind = smooth_noise(seed_ ^ kLeaderSalt, frame / kLeaderFrames);
  const double ahead =
      kLeaderNearest_m + kBillboardView_m * std::max(0.0, mind + 0.35 - 0.7 * busy_);
  if (ahead > kBillboardView_m) return;
  const StreetPoint at = drive_.ahead(frame, ahead, drive_.left_m(frame));
  const auto lap = static_cast<std::uint32_t>(drive_.lap(frame));
  scene.prisms.push_back(
      make_car(at.at, unit_vector(at.heading_rad), scramble(seed_ ^ kLeaderSalt ^ lap)));
}

void Traffic::add_people(int frame, int side, Scene& scene) const {
  const std::uint32_t stream = hash_of(seed_ ^ kPersonSalt, side);
  const double walked =
      frame * kPersonStep_m * side;  // one way on the left, the other on the right
  const double begin = drive_.driven_m(frame) + walked;
  const int first = floor_int(begin / kPersonSlot_m);
  const int last = floor_int((begin + kBillboardView_m) / kPersonSlot_m);
  for (int slot = first; slot <= last; ++slot) {
    const std::uint32_t detail = hash_of(stream, slot);
    if (unit(scramble(detail)) >= busy_) continue;
    const double ahead = (slot + 0.8 * unit(detail)) * kPersonSlot_m - begin;
    const double left = side * (kPavement_m + 0.8 * unit(scramble(detail + 1)) - 0.4);
    scene.billboards.push_back({Shape::person, drive_.ahead(frame, ahead, left).at, 0.4F, 1.85F,
                                detail, static_cast<float>(frame % 1000) * 0.17F});
  }
}

}  // namespace loopbit::town
