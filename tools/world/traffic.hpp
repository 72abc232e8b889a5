// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "drive.hpp"
#include "scene.hpp"

namespace loopbit::town {

/// Cars and people, different in every lap. `busy` (0 to 1) sets their number.
class Traffic {
 public:
  /// `circuit` and `drive` must outlive the traffic.
  Traffic(std::uint32_t seed, const Circuit& circuit, const Drive& drive, double busy);

  /// Adds everything within sight of the camera in `frame`.
  void add_to(int frame, Scene& scene) const;

 private:
  void add_parked(int frame, Vec2 eye, Scene& scene) const;
  void add_parked_along(GridPoint from, Vec2 along, int lap, Vec2 eye, Scene& scene) const;
  void add_oncoming(int frame, Scene& scene) const;
  void add_leader(int frame, Scene& scene) const;
  void add_people(int frame, int side, Scene& scene) const;

  std::uint32_t seed_;
  const Circuit& circuit_;
  const Drive& drive_;
  double busy_;
};

}  // namespace loopbit::town
