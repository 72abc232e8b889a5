// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/place_index.hpp"

#include "block_counts.hpp"
#include "mapped_memory.hpp"

namespace loopbit {

/// Consecutive places bounded together, coarse to fine. Neighbours in time look alike, so that the
/// maximum over a stretch is little more than any of its places.
inline constexpr std::array<std::size_t, 4> kStretchBits{5, 4, 3, 1};
inline constexpr std::array<std::size_t, 4> kStretchPlaces{32, 16, 8, 2};
inline constexpr std::size_t kFinestLevel = kStretchPlaces.size() - 1;

/// The coarsest stretches are bounded side by side, 16 at once.
inline constexpr std::size_t kGroupPlaces = kInterleaved * kStretchPlaces.front();

/// The largest coarse counts in each of 16 consecutive stretches, interleaved.
struct CoarseGroup {
  alignas(64) std::array<std::uint8_t, kInterleaved * kCoarseCounts> of;
};

/// The contents of all places, their counts, and bounds for stretches of them. Stretch i of a level
/// with n places a stretch holds the places i * n to (i + 1) * n - 1.
///
/// One thread may add while any number of others read what lies below a size() they have seen:
/// memory is in chunks that never move, and all about a place, and about a stretch that ends with
/// it, is written before size() tells of it, and never again.
class PlaceStore {
 public:
  /// The contents in memory.
  PlaceStore();
  /// The contents in `file` unless it is null, the rest in memory.
  explicit PlaceStore(std::unique_ptr<ScratchFile> file);

  /// Amortised constant time; a new chunk is taken every 65,536 places. Throws as MappedMemory and
  /// ScratchFile do, and stays as it was.
  PlaceId add(const BinaryContent& content);

  /// The next add() does not throw then. Throws as it does.
  void reserve_next();

  [[nodiscard]] PlaceId size() const { return size_.load(std::memory_order_acquire); }

  // Below: 0 <= place < size(), and stretches all of whose places are below size().

  /// The contents of places of one chunk follow each other.
  [[nodiscard]] const BinaryContent& content(std::size_t place) const {
    return chunks_[place / kChunkPlaces].contents[place % kChunkPlaces];
  }
  [[nodiscard]] int count(std::size_t place) const {
    return chunks_[place / kChunkPlaces].bounds->counts[place % kChunkPlaces];
  }
  /// The smallest |O| in a stretch, and in those after it: of the coarsest level, up to the end of
  /// the chunk; of the others, up to the end of the coarsest stretch that holds it, for all of
  /// which they share a cache line.
  [[nodiscard]] const std::uint16_t* smallest_counts(std::size_t level, std::size_t stretch) const {
    return smallest_count(level, stretch);
  }
  /// The largest block counts in a stretch, and, up to the end of the chunk, in those after it.
  [[nodiscard]] const PackedCounts* maxima(std::size_t level, std::size_t stretch) const {
    const Position at = position(level, stretch);
    return &at.bounds->maxima[at.record];
  }
  /// Likewise the largest coarse counts, by groups of 16 stretches of the coarsest level.
  [[nodiscard]] const CoarseGroup* coarse_group(std::size_t group) const {
    return &chunks_[group / kChunkGroups].bounds->coarse[group % kChunkGroups];
  }

 private:
  static constexpr std::size_t kChunkBits = 16;
  static constexpr std::size_t kChunkPlaces = std::size_t{1} << kChunkBits;
  static constexpr std::size_t kMaxChunks = (std::size_t{1} << 31U) / kChunkPlaces;
  static constexpr std::size_t kCoarsestStretches = kChunkPlaces / kStretchPlaces.front();
  static constexpr std::size_t kChunkGroups = kChunkPlaces / kGroupPlaces;

  /// Where the records of each level begin in a chunk, and, last, how many there are.
  static constexpr auto kFirstRecord = [] {
    std::array<std::size_t, kStretchPlaces.size() + 1> first{};
    for (std::size_t level = 0; level < kStretchPlaces.size(); ++level) {
      first[level + 1] = first[level] + kChunkPlaces / kStretchPlaces[level];
    }
    return first;
  }();

  /// The smallest |O| in the stretches within one of the coarsest. Those of a level with n of them
  /// begin at n, and n goes up by powers of 2.
  struct FinerSmallestCounts {
    alignas(64) std::array<std::uint16_t, kStretchPlaces.front()> of;
  };
  struct Bounds {
    std::array<CoarseGroup, kChunkGroups> coarse;
    std::array<PackedCounts, kFirstRecord.back()> maxima;
    std::array<FinerSmallestCounts, kCoarsestStretches> finer_smallest_counts;
    std::array<std::uint16_t, kCoarsestStretches> smallest_counts;
    std::array<std::uint16_t, kChunkPlaces> counts;
  };
  struct Chunk {
    BinaryContent* contents;
    Bounds* bounds;
  };
  struct Position {
    Bounds* bounds;
    std::size_t record;
  };
  struct Growing {
    BlockCounts maxima;
    std::uint16_t smallest_count = UINT16_MAX;

    void include(const Growing& other) {
      raise(maxima, other.maxima);
      smallest_count = std::min(smallest_count, other.smallest_count);
    }
  };

  [[nodiscard]] Position position(std::size_t level, std::size_t stretch) const {
    const std::size_t bits = kChunkBits - kStretchBits[level];
    const std::size_t in_chunk = stretch & ((std::size_t{1} << bits) - 1);
    return {chunks_[stretch >> bits].bounds, kFirstRecord[level] + in_chunk};
  }
  [[nodiscard]] std::uint16_t* smallest_count(std::size_t level, std::size_t stretch) const {
    const std::size_t bits = kStretchBits.front() - kStretchBits[level];
    const Position at = position(0, stretch >> bits);
    if (level == 0) return &at.bounds->smallest_counts[at.record];
    const std::size_t siblings = std::size_t{1} << bits;
    return &at.bounds->finer_smallest_counts[at.record].of[siblings + stretch % siblings];
  }
  [[nodiscard]] std::size_t num_chunks() const { return memory_.size() / 2; }
  void take_chunk();
  void extend_stretches(std::size_t place, const Growing& counts);
  void extend_coarse_stretch(std::size_t place, const CoarseCounts& counts);

  std::array<Growing, kStretchPlaces.size()> growing_;  ///< by level; the writer's
  CoarseCounts growing_coarse_;                         ///< the writer's, too
  std::unique_ptr<ScratchFile> file_;                   ///< of the contents, if any
  std::vector<MappedMemory> memory_;                    ///< of all chunks; for the writer only
  std::unique_ptr<Chunk[]> chunks_;  ///< room for all there can be; size_ tells how many are there
  std::atomic<PlaceId> size_ = 0;
};

}  // namespace loopbit
