// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "circuit.hpp"
#include "scene.hpp"

namespace loopbit::town {

enum class LotKind { house, garden, plain };

/// Where a lot is: its block (named by the crossing at the block's south-west corner), the side of
/// the block it faces (0 south, 1 east, 2 north, 3 west) and its number along that side.
struct LotKey {
  GridPoint block;
  int side = 0;
  int number = 0;

  bool operator==(const LotKey&) const = default;
};

/// A house, a garden with its hedge, or a length of plain wall on the edge of a block.
struct Lot {
  LotKind kind = LotKind::house;
  Vec2 front;    // middle of the front, on the edge of the block
  Vec2 inwards;  // unit vector from the street into the block
  double width_m = 7.0;
  double setback_m = 0.0;
  std::uint32_t detail = 0;
  HouseStyle style;
};

/// The style of a house with this `seed` and depth.
HouseStyle make_house_style(std::uint32_t seed, double depth_m);

/// Changes the season of all objects by `share`, 0 to 1: leaves fall, and houses are painted anew.
void change_season(Scene& scene, float share);

/// The town: streets on a square grid everywhere, blocks with houses around their edges between
/// them. Nothing is stored: a block's houses follow from the block's position and the seed.
class Town {
 public:
  /// `circuit` says where the plain walls are; it must outlive the town.
  Town(std::uint32_t seed, const Circuit& circuit, double look_alike);

  /// Adds all static objects within sight of `eye`.
  void add_surroundings(Vec2 eye, Scene& scene) const;

  /// The lot that a ray from `point` in a street enters first, and how far it goes until then.
  /// `direction` is a unit vector that is parallel to no street.
  [[nodiscard]] LotKey first_lot(Vec2 point, Vec2 direction, double& distance_m) const;

  /// Height of the object on a lot at the point that casts the shadow.
  [[nodiscard]] float top_m(const LotKey& key) const;

  /// Whether the ground is bare here.
  [[nodiscard]] bool bare_ground(Vec2 point) const;

  [[nodiscard]] double pitch_m() const { return pitch_m_; }

 private:
  struct Row {
    int lots = 0;
    double begin_m = 0.0;  // from the west or south corner of the block
    double length_m = 0.0;
  };
  [[nodiscard]] const Row& row(int side) const { return side % 2 == 0 ? full_row_ : short_row_; }
  [[nodiscard]] Lot lot(const LotKey& key) const;
  [[nodiscard]] HouseStyle style_of(std::uint32_t detail) const;
  void add_block(GridPoint block, Vec2 eye, Scene& scene) const;
  void add_lot(const Lot& lot, Scene& scene) const;
  void add_house(const Lot& lot, Scene& scene) const;
  void add_closing_walls(GridPoint crossing, Scene& scene) const;
  void add_street(GridPoint from, Vec2 along, Vec2 eye, Scene& scene) const;
  void add_furniture(Vec2 at, int slot, std::uint32_t detail, Scene& scene) const;

  std::uint32_t seed_;
  const Circuit& circuit_;
  double look_alike_;
  double pitch_m_;
  double block_m_;
  double depth_m_;
  Row full_row_;   // along the south and the north of a block
  Row short_row_;  // between them
};

/// Slots of a cache for the pixels of one frame.
constexpr std::size_t kMemorySlots = 512;

/// Where the ground is bare, in squares of a few metres. Remembers them; not thread-safe.
class BareGround {
 public:
  /// `town` must outlive this.
  explicit BareGround(const Town& town);

  [[nodiscard]] bool at(Vec2 point);

 private:
  struct Memory {
    GridPoint square;
    bool known = false;
    bool bare = false;
  };

  const Town& town_;
  std::vector<Memory> memory_;
};

}  // namespace loopbit::town
