// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "circuit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kUsualPitch_m = 44.0;
constexpr double kUsualBlank_m = 70.0;
constexpr double kPi = std::numbers::pi;
constexpr double kArc_m = Circuit::kCornerRadius_m * kPi / 2;
constexpr double kCornerSaves_m = 2 * Circuit::kCornerRadius_m - kArc_m;
constexpr std::array<GridPoint, 4> kSteps{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};

std::uint64_t key_of(GridPoint p) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(p.x)) << 32) |
         static_cast<std::uint32_t>(p.y);
}

Vec2 to_vec(GridPoint p) { return {static_cast<double>(p.x), static_cast<double>(p.y)}; }

GridPoint operator+(GridPoint a, GridPoint b) { return {a.x + b.x, a.y + b.y}; }
GridPoint operator-(GridPoint a, GridPoint b) { return {a.x - b.x, a.y - b.y}; }

/// A tree of cells of the double grid, with the doors between them: bit i opens towards kSteps[i].
class Tree {
 public:
  Tree(std::uint32_t seed, int cells) {
    Random random(seed);
    add({0, 0});
    while (static_cast<int>(cells_.size()) < cells) grow(random);
  }

  [[nodiscard]] bool open(GridPoint cell, std::size_t step) const {
    return ((find(cell)->second >> step) & 1U) != 0;
  }

 private:
  using Table = std::unordered_map<std::uint64_t, unsigned>;

  [[nodiscard]] Table::const_iterator find(GridPoint cell) const {
    return table_.find(key_of(cell));
  }

  void add(GridPoint cell) {
    cells_.push_back(cell);
    table_[key_of(cell)];
  }

  // Start from one of the newest cells, so that arms grow long before they fork.
  void grow(Random& random) {
    const int count = static_cast<int>(cells_.size());
    const int reach = random.chance(kForkShare) ? count : std::min(count, kYoungCells);
    const GridPoint from = cells_[static_cast<std::size_t>(count - 1 - random.pick(reach))];
    const auto step = static_cast<std::size_t>(random.pick(4));
    const GridPoint to = from + kSteps[step];
    if (find(to) != table_.end()) return;
    add(to);
    table_[key_of(from)] |= 1U << step;
    table_[key_of(to)] |= 1U << ((step + 2) % 4);
  }

  static constexpr float kForkShare = 0.2F;
  static constexpr int kYoungCells = 3;
  std::vector<GridPoint> cells_;
  Table table_;
};

/// The direction in which the walk around the tree leaves grid point `p`, with the tree on its
/// left. Cell (i, j) has the grid points 2i, 2i + 1 by 2j, 2j + 1.
std::size_t next_step(const Tree& tree, GridPoint p) {
  const int right = p.x & 1;
  const int top = p.y & 1;
  const GridPoint cell{(p.x - right) / 2, (p.y - top) / 2};
  // The side of the cell on which this point begins: south, east, north, west.
  const std::size_t along = top == 0 ? (right == 0 ? 0U : 1U) : (right == 1 ? 2U : 3U);
  const std::size_t outwards = (along + 3) % 4;
  return tree.open(cell, outwards) ? outwards : along;
}

std::vector<GridPoint> walk_around(const Tree& tree, int cells) {
  std::vector<GridPoint> corners;
  corners.reserve(static_cast<std::size_t>(cells) * 4);
  GridPoint at{0, 0};
  do {
    corners.push_back(at);
    at = at + kSteps[next_step(tree, at)];
  } while (!(at == GridPoint{0, 0}));
  return corners;
}

double wrap_m(double along_m, double length_m) {
  return along_m - length_m * std::floor(along_m / length_m);
}

}  // namespace

Circuit::Circuit(std::uint32_t seed, double length_m, double blank_share) {
  const int cells = std::max(1, floor_int(length_m / (4 * kUsualPitch_m) + 0.25));
  corners_ = walk_around(Tree(seed, cells), cells);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    index_.emplace_back(key_of(corners_[i]), static_cast<int>(i));
  }
  std::sort(index_.begin(), index_.end());
  measure(length_m);
  place_blanks(blank_share);
}

void Circuit::measure(double length_m) {
  const int count = static_cast<int>(corners_.size());
  int turns = 0;
  for (int i = 0; i < count; ++i) turns += turn_at(i) != 0 ? 1 : 0;
  pitch_m_ = (length_m + turns * kCornerSaves_m) / count;
  turns = 0;
  for (int i = 0; i <= count; ++i) {
    piece_start_m_.push_back(i * pitch_m_ - turns * kCornerSaves_m);
    turns += turn_at(i) != 0 ? 1 : 0;
  }
  length_m_ = length_m;
}

// Blank stretches are spread evenly, each around a corner, where only the walls are ahead.
void Circuit::place_blanks(double share) {
  if (share <= 0) return;
  const int stretches = std::max(1, floor_int(share * length_m_ / kUsualBlank_m + 0.5));
  // Corners are not spread evenly, so a whole circuit needs longer stretches.
  blank_half_m_ = share < 1 ? share * length_m_ / stretches / 2 : length_m_;
  for (int i = 0; i < stretches; ++i) {
    int piece = piece_at(length_m_ * (i + 0.5) / stretches);
    while (turn_at(piece) == 0) ++piece;
    blank_centre_m_.push_back(middle_m(piece % static_cast<int>(corners_.size())));
  }
  std::sort(blank_centre_m_.begin(), blank_centre_m_.end());
}

GridPoint Circuit::corner(int index) const {
  const int count = static_cast<int>(corners_.size());
  return corners_[static_cast<std::size_t>((index % count + count) % count)];
}

GridPoint Circuit::step_after(int index) const { return corner(index + 1) - corner(index); }

// Position of this corner on the circuit.
double Circuit::middle_m(int index) const {
  const auto at = static_cast<std::size_t>(index);
  return (piece_start_m_[at] + piece_start_m_[at + 1]) / 2;
}

// 1 to the left, -1 to the right, 0 straight on.
int Circuit::turn_at(int index) const {
  const GridPoint in = step_after(index - 1);
  const GridPoint out = step_after(index);
  return in.x * out.y - in.y * out.x;
}

int Circuit::piece_at(double along_m) const {
  const auto after = std::upper_bound(piece_start_m_.begin(), piece_start_m_.end(), along_m);
  const auto piece = static_cast<int>(after - piece_start_m_.begin()) - 1;
  return std::clamp(piece, 0, static_cast<int>(corners_.size()) - 1);
}

StreetPoint Circuit::at(double along_m, double left_m) const {
  const double along = wrap_m(along_m, length_m_);
  const int piece = piece_at(along);
  const int turn = turn_at(piece);
  double rest = along - piece_start_m_[static_cast<std::size_t>(piece)];
  Vec2 forward = to_vec(step_after(piece - 1));
  const Vec2 centre = to_vec(corner(piece)) * pitch_m_;
  const double in_heading = forward.x != 0 ? (forward.x > 0 ? 0 : kPi) : forward.y * kPi / 2;
  Vec2 at = centre - forward * (pitch_m_ / 2);
  const double before_arc = pitch_m_ / 2 - kCornerRadius_m;
  if (turn == 0 || rest <= before_arc) {
    return {at + forward * rest + left_of(forward) * left_m, in_heading};
  }
  const double angle = std::min(rest - before_arc, kArc_m) / kCornerRadius_m * turn;
  const auto [sin, cos] = sin_cos(angle);
  const Vec2 side = left_of(forward) * turn;
  at = at + forward * (before_arc + kCornerRadius_m * std::abs(sin)) +
       side * (kCornerRadius_m * (1 - cos));
  forward = forward * cos + left_of(forward) * sin;
  rest = std::max(0.0, rest - before_arc - kArc_m);
  return {at + forward * rest + left_of(forward) * left_m, in_heading + angle};
}

bool Circuit::blank_at(double along_m) const {
  if (blank_centre_m_.empty()) return false;
  const double along = wrap_m(along_m, length_m_);
  const auto after = std::lower_bound(blank_centre_m_.begin(), blank_centre_m_.end(), along);
  const double next = after == blank_centre_m_.end() ? blank_centre_m_.front() : *after;
  const double last = after == blank_centre_m_.begin() ? blank_centre_m_.back() : *(after - 1);
  const auto apart = [&](double centre) {
    return std::min(wrap_m(centre - along, length_m_), wrap_m(along - centre, length_m_));
  };
  return std::min(apart(next), apart(last)) <= blank_half_m_;
}

// side -1: the half street before the corner; 1: the one after it.
bool Circuit::blank_arm(int index, int side, Vec2 point, double reach_m) const {
  const Vec2 outwards = to_vec(side < 0 ? step_after(index - 1) : step_after(index)) * side;
  const Vec2 corner_at = to_vec(corner(index)) * pitch_m_;
  const double out = std::clamp(dot(point - corner_at, outwards), 0.0, pitch_m_ / 2);
  const Vec2 apart = point - (corner_at + outwards * out);
  if (dot(apart, apart) > reach_m * reach_m) return false;
  const auto at = static_cast<std::size_t>(index);
  const double scale = (piece_start_m_[at + 1] - piece_start_m_[at]) / pitch_m_;
  return blank_at(middle_m(index) + side * out * scale);
}

std::vector<GridPoint> Circuit::closed_steps(GridPoint crossing) const {
  const auto* entry = find(crossing);
  if (entry == nullptr || !blank_at(middle_m(entry->second))) return {};
  const GridPoint back = corner(entry->second - 1) - crossing;
  const GridPoint onwards = step_after(entry->second);
  std::vector<GridPoint> closed;
  for (const GridPoint step : kSteps) {
    if (!(step == back) && !(step == onwards)) closed.push_back(step);
  }
  return closed;
}

bool Circuit::blank_near(Vec2 point, double reach_m) const {
  if (blank_centre_m_.empty()) return false;
  const GridPoint low{floor_int(point.x / pitch_m_), floor_int(point.y / pitch_m_)};
  constexpr std::array kCorners{GridPoint{0, 0}, GridPoint{1, 0}, GridPoint{0, 1}, GridPoint{1, 1}};
  return std::any_of(kCorners.begin(), kCorners.end(), [&](GridPoint corner) {
    const auto* entry = find(low + corner);
    return entry != nullptr && (blank_arm(entry->second, -1, point, reach_m) ||
                                blank_arm(entry->second, 1, point, reach_m));
  });
}

const std::pair<std::uint64_t, int>* Circuit::find(GridPoint point) const {
  const std::pair<std::uint64_t, int> wanted{key_of(point), -1};
  const auto found = std::lower_bound(index_.begin(), index_.end(), wanted);
  return found != index_.end() && found->first == wanted.first ? &*found : nullptr;
}

std::size_t Circuit::storage_bytes() const {
  return corners_.capacity() * sizeof(corners_[0]) + index_.capacity() * sizeof(index_[0]) +
         piece_start_m_.capacity() * sizeof(double) + blank_centre_m_.capacity() * sizeof(double);
}

}  // namespace loopbit::town
