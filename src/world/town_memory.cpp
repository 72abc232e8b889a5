// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "town_memory.hpp"

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr std::size_t kMemorySlots = 512;
constexpr double kSquare_m = 4.0;  // of bare or other ground

std::size_t slot_of(const LotKey& key) {
  return hash_of(hash_of(0, key.block.x, key.block.y), key.side, key.number) % kMemorySlots;
}

}  // namespace

Shadows::Shadows(const Town& town, const Light& light)
    : town_(town), to_sun_(light.to_sun), rise_(light.rise), memory_(kMemorySlots) {}

float Shadows::top_m(const LotKey& key) {
  if (last_.top_m >= 0 && last_.key == key) return last_.top_m;
  Memory& memory = memory_[slot_of(key)];
  if (memory.top_m < 0 || !(memory.key == key)) memory = {key, town_.top_m(key)};
  last_ = memory;
  return memory.top_m;
}

float Shadows::height_at(Vec2 point) {
  double distance_m = 0.0;
  const LotKey key = town_.first_lot(point, to_sun_, distance_m);
  return top_m(key) - static_cast<float>(distance_m * rise_);
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
