// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "loopbit/world.hpp"

#include "circuit.hpp"

namespace loopbit::town {

/// The way of the camera along the circuit, lap after lap.
class Drive {
 public:
  /// `circuit` must outlive the drive.
  Drive(const WorldOptions& options, const Circuit& circuit);

  [[nodiscard]] int lap(int frame) const;
  [[nodiscard]] int floor(int frame) const;
  /// Whether the camera is on its way from `floor` to the next.
  [[nodiscard]] bool on_ramp(int frame) const;
  /// Above the lowest floor.
  [[nodiscard]] double height_m(int frame) const;
  [[nodiscard]] double driven_m(int frame) const { return frame * spacing_m_; }
  /// Between plain walls, as the ramps are.
  [[nodiscard]] bool blank(int frame) const;
  [[nodiscard]] StreetPoint camera(int frame) const;

  /// How far left of the centre line, seen in the direction of travel, the camera is.
  [[nodiscard]] double left_m(int frame) const;

  /// The point `ahead_m` metres further in the direction of travel, `left_m` left of the centre
  /// line. Its heading is that of the street there, in the direction of travel.
  [[nodiscard]] StreetPoint ahead(int frame, double ahead_m, double left_m) const;

 private:
  [[nodiscard]] double on_floor_m(int frame) const;
  [[nodiscard]] double along_m(int frame) const;
  [[nodiscard]] bool reversed(int frame) const { return reverse_second_ && lap(frame) == 1; }
  [[nodiscard]] double line_m(int frame, double ahead_m) const;

  const Circuit& circuit_;
  std::uint32_t seed_;
  double spacing_m_;
  double lateral_offset_m_;
  int floors_;
  double floor_m_;  ///< driven on each floor
  bool reverse_second_;
};

}  // namespace loopbit::town
