// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace loopbit::town {

struct Vec2 {
  double x = 0.0;
  double y = 0.0;
};

constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator*(Vec2 a, double s) { return {a.x * s, a.y * s}; }
constexpr double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
constexpr Vec2 left_of(Vec2 a) { return {-a.y, a.x}; }

/// Grid point (x, y) is the crossing at (x, y) * pitch metres.
struct GridPoint {
  int x = 0;
  int y = 0;

  bool operator==(const GridPoint&) const = default;
};

/// A point of the street's centre line, or beside it, and the direction of travel there.
struct StreetPoint {
  Vec2 at;
  double heading_rad = 0.0;
};

/// The closed street circuit: straight along a square grid of streets, in quarter circles around
/// its corners. It goes once around a tree of grid cells grown at random, so it winds, never meets
/// itself, and any length from kShortestCircuit_m up can be had by choosing cells and pitch.
class Circuit {
 public:
  static constexpr double kCornerRadius_m = 8.0;
  static constexpr double kShortestCircuit_m = 106.0;

  /// `blank_share`: 0 to 1; with 1, all of it is blank.
  Circuit(std::uint32_t seed, double length_m, double blank_share);

  [[nodiscard]] double length_m() const { return length_m_; }
  [[nodiscard]] double pitch_m() const { return pitch_m_; }

  /// The point `along_m` metres after the start, `left_m` metres to the left; along_m may have any
  /// value and wraps around.
  [[nodiscard]] StreetPoint at(double along_m, double left_m) const;

  /// Whether the circuit is blank here; along_m wraps around.
  [[nodiscard]] bool blank_at(double along_m) const;

  /// Whether a blank part of the circuit is within reach_m of `point`.
  [[nodiscard]] bool blank_near(Vec2 point, double reach_m) const;

  /// The streets from a crossing that the circuit does not take, if it is blank there; none if not.
  [[nodiscard]] std::vector<GridPoint> closed_steps(GridPoint crossing) const;

  [[nodiscard]] std::size_t storage_bytes() const;

 private:
  [[nodiscard]] GridPoint corner(int index) const;
  [[nodiscard]] GridPoint step_after(int index) const;
  [[nodiscard]] int turn_at(int index) const;
  [[nodiscard]] double middle_m(int index) const;
  [[nodiscard]] int piece_at(double along_m) const;
  [[nodiscard]] bool blank_arm(int index, int side, Vec2 point, double reach_m) const;
  [[nodiscard]] const std::pair<std::uint64_t, int>* find(GridPoint point) const;
  void measure(double length_m);
  void place_blanks(double share);

  std::vector<GridPoint> corners_;
  std::vector<std::pair<std::uint64_t, int>> index_;  // grid point to position in corners_, sorted
  std::vector<double> piece_start_m_;                 // one per corner, and the end
  std::vector<double> blank_centre_m_;
  double blank_half_m_ = 0.0;
  double length_m_ = 0.0;
  double pitch_m_ = 0.0;
};

}  // namespace loopbit::town
