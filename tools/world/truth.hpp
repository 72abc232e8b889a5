// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/world.hpp"

#include "circuit.hpp"

namespace loopbit::town {

/// The rule by which two views show the same place.
struct PlaceRule {
  double distance_m = 4.0;  // between the camera centres, at most
  double cos_turn = 0.866;  // of the angle between the headings, at least
  bool opposite = false;    // or between one heading and the opposite of the other
  int frames_between = 50;  // at least
  bool ramps = false;       // whether a ramp is near the floors that it joins
};

/// All pairs that follow the rule, as runs; see World::same_place(). views[i].forward is a unit
/// vector.
struct View {
  Vec2 at;
  Vec2 forward;
  double height_m = 0.0;
  bool on_ramp = false;
};
std::vector<PlaceRun> find_places(const std::vector<View>& views, const PlaceRule& rule);

}  // namespace loopbit::town
