// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "light.hpp"
#include "town.hpp"

// Caches for repeated queries of the pixels of a frame.
namespace loopbit::town {

/// The shadows of houses. Remembers the heights it has looked up; not thread-safe.
class Shadows {
 public:
  /// `town` must outlive the shadows.
  Shadows(const Town& town, const Light& light);

  /// The height below which `point`, in a street, is in the shade, in metres; may be below 0.
  [[nodiscard]] float height_at(Vec2 point);

 private:
  struct Memory {
    LotKey key;
    float top_m = -1.0F;
  };
  [[nodiscard]] float top_m(const LotKey& key);

  const Town& town_;
  Vec2 to_sun_;
  double rise_;
  std::vector<Memory> memory_;
  Memory last_;
};

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
