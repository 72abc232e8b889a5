// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "town.hpp"

#include <algorithm>
#include <cmath>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kUsualLot_m = 7.2;
constexpr double kDeepest_m = 9.0;
constexpr int kLookAlikeTypes = 3;
constexpr float kGardenShare = 0.1F;
constexpr float kHedge_m = 1.3F;
constexpr float kPlainWall_m = 6.0F;
constexpr double kPlainThickness_m = 0.4;
constexpr double kBareReach_m = 12.0;
constexpr double kFarthestLot_m = 1000.0;
constexpr double kFurnitureLine_m = 6.0;
constexpr double kFurnitureSlot_m = 7.0;
constexpr int kSlotsPerLamp = 3;
constexpr double kSquare_m = 4.0;  // of bare or other ground

// Salts give different things at one place different hashes.
constexpr std::uint32_t kLotSalt = 0x10701U;
constexpr std::uint32_t kTypeSalt = 0x7e1bU;
constexpr std::uint32_t kStreetSalt = 0x57e7U;
constexpr std::uint32_t kSeasonSalt = 0x5ea5U;

double span_sq(Vec2 a, Vec2 b) { return dot(a - b, a - b); }

void set_outline(Prism& prism, std::initializer_list<OutlinePoint> points) {
  std::copy(points.begin(), points.end(), prism.outline.begin());
  prism.outline_size = static_cast<int>(points.size());
}

/// A box on a lot: from `begin` to `end` metres behind the edge of the block, over its full width.
Prism box_on(const Lot& lot, double begin_m, double end_m, float height_m) {
  Prism box;
  box.centre = lot.front + lot.inwards * ((begin_m + end_m) / 2);
  box.axis = left_of(lot.inwards) * -1.0;
  box.half_length_m = static_cast<float>(lot.width_m / 2);
  box.detail = lot.detail;
  const auto half = static_cast<float>((end_m - begin_m) / 2);
  set_outline(box, {{-half, height_m}, {half, height_m}});
  return box;
}

/// Metres until a ray leaves the band of half width kFront_m around the nearest street line.
double exit_of_band(double across, double direction) {
  if (std::abs(across) > kFront_m) return 0.0;
  return ((direction > 0 ? kFront_m : -kFront_m) - across) / direction;
}

int lots_along(double length_m) {
  if (length_m < kUsualLot_m / 2) return 0;
  return std::max(1, floor_int(length_m / kUsualLot_m + 0.5));
}

/// Distance to the nearest line of a square grid.
double from_nearest_line(double value, double pitch, double lines_a_metre) {
  return value - pitch * floor_int(value * lines_a_metre + 0.5);
}

}  // namespace

void change_season(Scene& scene, float share) {
  constexpr float kPainted = 0.6F;
  scene.season = share;
  for (Billboard& board : scene.billboards) board.bare = share;
  for (Prism& prism : scene.prisms) {
    if (prism.wall != Wall::house && prism.wall != Wall::chimney) continue;
    const std::uint32_t hash = scramble(prism.detail ^ kSeasonSalt);
    if (unit(hash) >= kPainted * share) continue;
    const HouseStyle painted = make_house_style(scramble(hash), kDeepest_m);
    HouseStyle& style = prism.style;
    style.seed = painted.seed;
    style.masonry = painted.masonry;
    style.wall = painted.wall;
    style.trim = painted.trim;
    style.frame = painted.frame;
    style.shutter = painted.shutter;
    style.door = painted.door;
    style.sign = painted.sign;
  }
}

Town::Town(std::uint32_t seed, const Circuit& circuit, double look_alike)
    : seed_(seed),
      circuit_(circuit),
      look_alike_(look_alike),
      pitch_m_(circuit.pitch_m()),
      block_m_(pitch_m_ - 2 * kFront_m),
      depth_m_(std::min(kDeepest_m, block_m_ / 2.2)) {
  full_row_ = {lots_along(block_m_), 0.0, block_m_};
  short_row_ = {lots_along(block_m_ - 2 * depth_m_), depth_m_, block_m_ - 2 * depth_m_};
}

HouseStyle Town::style_of(std::uint32_t detail) const {
  Random random(detail);
  const bool copy = random.chance(static_cast<float>(look_alike_));
  const std::uint32_t type = hash_of(seed_ ^ kTypeSalt, random.pick(kLookAlikeTypes));
  return make_house_style(copy ? type : random.bits(), depth_m_);
}

Lot Town::lot(const LotKey& key) const {
  constexpr std::array<Vec2, 4> kInwards{{{0, 1}, {-1, 0}, {0, -1}, {1, 0}}};
  const Row& side = row(key.side);
  Lot lot;
  lot.width_m = side.length_m / side.lots;
  lot.inwards = kInwards[static_cast<std::size_t>(key.side)];
  const double along = side.begin_m + (key.number + 0.5) * lot.width_m;
  const double across = key.side == 1 || key.side == 2 ? block_m_ : 0.0;
  const Vec2 in_block = key.side % 2 == 0 ? Vec2{along, across} : Vec2{across, along};
  lot.front =
      Vec2{key.block.x * pitch_m_, key.block.y * pitch_m_} + in_block + Vec2{kFront_m, kFront_m};
  lot.detail = hash_of(hash_of(seed_ ^ kLotSalt, key.block.x, key.block.y), key.side, key.number);
  Random random(lot.detail + 1);
  lot.setback_m = random.chance(0.3F) ? 0.0 : random.between(0.0F, 0.5F);
  if (circuit_.blank_near(lot.front, kBlankReach_m)) {
    lot.kind = LotKind::plain;
  } else {
    lot.kind = random.chance(kGardenShare) ? LotKind::garden : LotKind::house;
    lot.style = style_of(lot.detail);
  }
  return lot;
}

float Town::top_m(const LotKey& key) const {
  const Lot at = lot(key);
  if (at.kind == LotKind::plain) return kPlainWall_m;
  return at.kind == LotKind::garden ? kHedge_m : (at.style.eaves_m + at.style.ridge_m) / 2;
}

LotKey Town::first_lot(Vec2 point, Vec2 direction, double& distance_m) const {
  const double lines_a_metre = 1.0 / pitch_m_;
  const double off_x = from_nearest_line(point.x, pitch_m_, lines_a_metre);
  const double off_y = from_nearest_line(point.y, pitch_m_, lines_a_metre);
  const double exit_x = exit_of_band(off_x, direction.x);
  const double exit_y = exit_of_band(off_y, direction.y);
  distance_m = std::min(std::max(exit_x, exit_y), kFarthestLot_m);
  const Vec2 entry = point + direction * distance_m;
  LotKey key;
  key.block = {floor_int(entry.x * lines_a_metre), floor_int(entry.y * lines_a_metre)};
  const Vec2 in_block =
      entry - Vec2{key.block.x * pitch_m_ + kFront_m, key.block.y * pitch_m_ + kFront_m};
  const bool through_x = exit_x > exit_y;
  key.side = through_x ? (direction.x > 0 ? 3 : 1) : (direction.y > 0 ? 0 : 2);
  if (through_x && (in_block.y < depth_m_ || row(key.side).lots == 0)) key.side = 0;
  if (through_x && in_block.y > block_m_ - depth_m_) key.side = 2;
  const Row& side = row(key.side);
  const double along = (key.side % 2 == 0 ? in_block.x : in_block.y) - side.begin_m;
  key.number = std::clamp(floor_int(along / side.length_m * side.lots), 0, side.lots - 1);
  return key;
}

void Town::add_house(const Lot& lot, Scene& scene) const {
  const HouseStyle& style = lot.style;
  Prism house = box_on(lot, lot.setback_m, depth_m_, style.eaves_m);
  const float half = house.v_max();
  house.wall = Wall::house;
  house.style = style;
  set_outline(house, {{-half, style.eaves_m}, {0.0F, style.ridge_m}, {half, style.eaves_m}});
  scene.prisms.push_back(house);

  Random random(style.seed + 1);
  Prism chimney = house;
  chimney.wall = Wall::chimney;
  const double beside = random.between(-0.4F, 0.4F) * lot.width_m;
  chimney.centre = house.centre + house.axis * beside;
  chimney.half_length_m = random.between(0.3F, 0.7F);
  const float top = style.ridge_m + random.between(0.4F, 1.1F);
  set_outline(chimney, {{-0.35F, top}, {0.35F, top}});
  scene.prisms.push_back(chimney);
}

void Town::add_lot(const Lot& lot, Scene& scene) const {
  if (lot.kind == LotKind::house) return add_house(lot, scene);
  if (lot.kind == LotKind::plain) {
    scene.prisms.push_back(box_on(lot, 0.0, kPlainThickness_m, kPlainWall_m));
    return;
  }
  Prism hedge = box_on(lot, 0.1, 0.9, kHedge_m);
  hedge.wall = Wall::hedge;
  scene.prisms.push_back(hedge);
  Random random(lot.detail + 2);
  const float height = random.between(5.0F, 8.0F);
  scene.billboards.push_back(
      {Shape::tree, lot.front + lot.inwards * 3.5, height * 0.4F, height, random.bits(), 0.0F});
}

// Streets that the circuit does not use end at its blank crossings.
void Town::add_closing_walls(GridPoint crossing, Scene& scene) const {
  for (const GridPoint step : circuit_.closed_steps(crossing)) {
    const Vec2 outwards{static_cast<double>(step.x), static_cast<double>(step.y)};
    Lot across;
    across.kind = LotKind::plain;
    across.inwards = outwards;
    across.front = Vec2{crossing.x * pitch_m_, crossing.y * pitch_m_} + outwards * kFront_m;
    across.width_m = 2 * kFront_m;
    across.detail = hash_of(hash_of(seed_, crossing.x, crossing.y), step.x, step.y);
    add_lot(across, scene);
  }
}

bool Town::bare_ground(Vec2 point) const { return circuit_.blank_near(point, kBareReach_m); }

void Town::add_block(GridPoint block, Vec2 eye, Scene& scene) const {
  for (int side_number = 0; side_number < 4; ++side_number) {
    const int lots = row(side_number).lots;
    for (int number = 0; number < lots; ++number) {
      const Lot at = lot({block, side_number, number});
      if (span_sq(at.front, eye) < kView_m * kView_m) add_lot(at, scene);
    }
  }
}

void Town::add_furniture(Vec2 at, int slot, std::uint32_t detail, Scene& scene) const {
  if (circuit_.blank_near(at, kBlankReach_m)) return;
  Random random(detail);
  if (slot % kSlotsPerLamp == 1) {
    scene.billboards.push_back({Shape::lamp, at, 0.5F, 5.2F, detail, 0.0F});
  } else if (random.chance(0.3F)) {
    const float height = random.between(4.0F, 7.0F);
    scene.billboards.push_back({Shape::tree, at, height * 0.38F, height, detail, 0.0F});
  } else if (random.chance(0.35F)) {
    scene.billboards.push_back({Shape::sign, at, 0.4F, 2.8F, detail, 0.0F});
  }
}

void Town::add_street(GridPoint from, Vec2 along, Vec2 eye, Scene& scene) const {
  const Vec2 begin = Vec2{from.x * pitch_m_, from.y * pitch_m_} + along * (kFront_m + 1.5);
  const int slots = floor_int((block_m_ - 3.0) / kFurnitureSlot_m) + 1;
  const std::uint32_t street = hash_of(seed_ ^ kStreetSalt, from.x, from.y);
  for (int slot = 0; slot < 2 * slots; ++slot) {
    const double side = slot < slots ? 1.0 : -1.0;
    const std::uint32_t detail = hash_of(street, slot, along.x > 0 ? 1 : 0);
    const double shift = (slot % slots + 0.5 * unit(detail)) * kFurnitureSlot_m;
    const Vec2 at = begin + along * shift + left_of(along) * (side * kFurnitureLine_m);
    if (span_sq(at, eye) > kBillboardView_m * kBillboardView_m) continue;
    add_furniture(at, slot % slots + (slot < slots ? 0 : 1), detail, scene);
  }
}

void Town::add_surroundings(Vec2 eye, Scene& scene) const {
  const int reach = floor_int(kView_m / pitch_m_) + 1;
  const GridPoint here{floor_int(eye.x / pitch_m_), floor_int(eye.y / pitch_m_)};
  for (int y = here.y - reach; y <= here.y + reach; ++y) {
    for (int x = here.x - reach; x <= here.x + reach; ++x) {
      add_block({x, y}, eye, scene);
      add_closing_walls({x, y}, scene);
      add_street({x, y}, {1, 0}, eye, scene);
      add_street({x, y}, {0, 1}, eye, scene);
    }
  }
}

BareGround::BareGround(const Town& town) : town_(town), memory_(kMemorySlots) {}

bool BareGround::at(Vec2 point) {
  const GridPoint square{floor_int(point.x / kSquare_m), floor_int(point.y / kSquare_m)};
  const std::uint32_t slot = hash_of(0, square.x, square.y) % kMemorySlots;
  Memory& memory = memory_[slot];
  if (!memory.known || !(memory.square == square)) {
    const Vec2 middle{(square.x + 0.5) * kSquare_m, (square.y + 0.5) * kSquare_m};
    memory = {square, true, town_.bare_ground(middle)};
  }
  return memory.bare;
}

}  // namespace loopbit::town
