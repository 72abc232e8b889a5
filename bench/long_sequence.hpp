// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/world.hpp"

namespace loopbit::bench {

/// The saliency map of a frame, 64 x 64, divided by its mean.
using Saliency = std::array<float, std::size_t{kContentSide} * kContentSide>;

/// Contents of a camera that wanders for months: towns of the built-in world and real places in
/// turn, 100 key frames at a stretch, lap after lap. Every frame is made, not recorded:
///  - key frames are frames of the world (0.9 m apart) or of a real data set;
///  - between two of them lie 26 others: their saliency maps, cross-faded, which makes the world
///    30 frames a second at 1 m/s;
///  - every frame flickers: its map is multiplied by a smooth random field, so that neighbours are
///    as alike as in a drive that is rendered at 30 frames a second (see docs/retrieval.md);
///  - every lap differs: each key frame's map is multiplied by a stronger smooth field, and every
///    second lap is mirrored, which makes it another place.
class LongSequence {
 public:
  /// `data`: the folder of real images; empty = the world alone. `seed` gives other towns.
  LongSequence(const std::string& data, const std::vector<std::string>& real, int first_seed,
               int towns);

  /// The next frame. About 10 microseconds.
  BinaryContent next();

  void restart() { frame_ = 0; }

  /// The place of the key frame `number`, seen again in a lap that is not in the sequence. A key
  /// frame of the world is rendered anew: 1 m beside, in other light, among other traffic. One of a
  /// real set gets another smooth field, and is shifted sideways by up to 2 columns.
  [[nodiscard]] BinaryContent revisit(std::size_t number) const;

  /// Key frame `number` as its lap has it.
  [[nodiscard]] BinaryContent key_frame_of_lap(std::size_t number) const;

  /// Key frame `number` as it is.
  [[nodiscard]] BinaryContent key_frame(std::size_t number) const;

  static constexpr std::size_t kFramesPerKeyFrame = 27;

 private:
  struct Source {
    std::vector<Saliency> key_frames;
    std::shared_ptr<const World> town;  ///< null for a real set
  };
  /// 100 key frames of a source.
  struct Segment {
    std::size_t source;
    std::size_t first;
  };
  struct Position {
    const Source* source;
    std::size_t at;  ///< in the source
    std::uint64_t lap;
  };

  [[nodiscard]] Position position(std::size_t number) const;
  [[nodiscard]] Saliency in_its_lap(std::size_t number) const;

  std::vector<Source> sources_;
  std::vector<Segment> town_segments_;
  std::vector<Segment> real_segments_;
  std::vector<Saliency> fields_;  ///< smooth and random, mean 0, standard deviation 1
  std::size_t frame_ = 0;
  Saliency from_{};
  Saliency to_{};
};

}  // namespace loopbit::bench
