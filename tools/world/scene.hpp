// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "circuit.hpp"
#include "color.hpp"

// The objects around one frame. A scene is made for one frame.
namespace loopbit::town {

enum class Wall { house, plain, chimney, hedge, car };

enum class Masonry { plaster, brick, stone, concrete };

/// How a house looks. All lengths in metres; everything else follows from the seed. Houses with the
/// same seed are look-alikes.
struct HouseStyle {
  std::uint32_t seed = 0;
  Masonry masonry = Masonry::plaster;
  Color wall, trim, frame, shutter, door, roof, sign;
  int floors = 2;
  float ground_floor_m = 3.2F;
  float floor_m = 2.9F;
  float eaves_m = 6.1F;
  float ridge_m = 8.5F;
  float bay_m = 2.4F;
  float window_width_m = 1.1F;
  float window_height_m = 1.4F;
  int panes = 2;
  bool shutters = false;
  bool surrounds = false;
  bool shop = false;
  bool balconies = false;
};

/// A point of a prism's outline: v metres along, z metres up.
struct OutlinePoint {
  float v = 0.0F;
  float z = 0.0F;
};

/// An outline in the plane of the vertical and `left_of(axis)`, drawn out along `axis`: a gable
/// drawn out along the street is a house, the side view of a car drawn out across it is a car.
struct Prism {
  static constexpr int kMaxOutline = 8;

  Wall wall = Wall::plain;
  Vec2 centre;
  Vec2 axis{1.0, 0.0};
  float half_length_m = 1.0F;  // along the axis
  std::array<OutlinePoint, kMaxOutline> outline{};
  int outline_size = 0;  // at least 2; v rises
  std::uint32_t detail = 0;
  HouseStyle style;  // houses and chimneys; of other walls, `wall` alone

  [[nodiscard]] float v_min() const { return outline[0].v; }
  [[nodiscard]] float v_max() const {
    return outline[static_cast<std::size_t>(outline_size - 1)].v;
  }
};

enum class Shape { tree, lamp, sign, person };

/// A flat thing that always faces the camera.
struct Billboard {
  Shape shape = Shape::tree;
  Vec2 at;
  float half_width_m = 1.0F;
  float height_m = 1.0F;
  std::uint32_t detail = 0;
  float phase = 0.0F;  // of the steps of a person
  float bare = 0.0F;   // share of a tree's leaves that have fallen
};

struct Scene {
  std::vector<Prism> prisms;
  std::vector<Billboard> billboards;
  float season = 0.0F;  // see change_season()
};

/// Half widths across a street, from its centre line, in metres.
constexpr float kLaneEdge_m = 3.6F;
constexpr float kKerb_m = 5.5F;
constexpr float kFront_m = 7.5F;

/// How far prisms and billboards are drawn.
constexpr double kView_m = 150.0;
constexpr double kBillboardView_m = 80.0;

/// Distance around a blank part of the circuit with nothing but plain walls.
constexpr double kBlankReach_m = 26.0;

}  // namespace loopbit::town
