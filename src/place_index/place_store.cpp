// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_store.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace loopbit {
namespace {

/// From this chunk on a map is so large that the last, half-empty large page hardly counts.
constexpr std::size_t kFirstChunkOfLargePages = 4;

}  // namespace

PlaceStore::PlaceStore() : PlaceStore(nullptr) {}

// The table of chunks is not touched before it is needed: new memory of that size costs nothing.
PlaceStore::PlaceStore(std::unique_ptr<ScratchFile> file)
    : file_(std::move(file)), chunks_(std::make_unique_for_overwrite<Chunk[]>(kMaxChunks)) {}

void PlaceStore::reserve_next() {
  const PlaceId id = size_.load(std::memory_order_relaxed);
  if (id == std::numeric_limits<PlaceId>::max()) {
    throw std::length_error("a place index holds at most 2,147,483,647 places");
  }
  if (static_cast<std::size_t>(id) / kChunkPlaces == num_chunks()) take_chunk();
}

PlaceId PlaceStore::add(const BinaryContent& content) {
  reserve_next();
  const PlaceId id = size_.load(std::memory_order_relaxed);
  const auto place = static_cast<std::size_t>(id);
  const Chunk& chunk = chunks_[place / kChunkPlaces];
  chunk.contents[place % kChunkPlaces] = content;
  const BlockCounts blocks = block_counts(content);
  const CoarseCounts coarse = coarse_counts(blocks);
  const auto set = static_cast<std::uint16_t>(loopbit::count(coarse));
  chunk.bounds->counts[place % kChunkPlaces] = set;
  extend_stretches(place, {blocks, set});
  extend_coarse_stretch(place, coarse);
  size_.store(id + 1, std::memory_order_release);
  return id;
}

void PlaceStore::take_chunk() {
  const std::size_t number = num_chunks();
  constexpr std::size_t kContentsBytes = kChunkPlaces * sizeof(BinaryContent);
  memory_.reserve(memory_.size() + 2);
  MappedMemory contents = file_ ? file_->extend(kContentsBytes) : MappedMemory(kContentsBytes);
  MappedMemory bounds(sizeof(Bounds));
  if (number >= kFirstChunkOfLargePages) {
    bounds.prefer_large_pages();
    if (!file_) contents.prefer_large_pages();
  }
  chunks_[number] = {static_cast<BinaryContent*>(contents.data()),
                     static_cast<Bounds*>(bounds.data())};
  memory_.push_back(std::move(contents));
  memory_.push_back(std::move(bounds));
}

void PlaceStore::extend_stretches(std::size_t place, const Growing& counts) {
  const Growing* finer = &counts;
  for (std::size_t level = kStretchPlaces.size(); level-- > 0;) {
    Growing& growing = growing_[level];
    growing.include(*finer);
    if (level < kFinestLevel) growing_[level + 1] = {};
    if ((place + 1) % kStretchPlaces[level] != 0) return;
    const Position at = position(level, place / kStretchPlaces[level]);
    at.bounds->maxima[at.record] = packed(growing.maxima);
    *smallest_count(level, place / kStretchPlaces[level]) = growing.smallest_count;
    finer = &growing;
  }
  growing_[0] = {};
}

void PlaceStore::extend_coarse_stretch(std::size_t place, const CoarseCounts& counts) {
  raise(growing_coarse_, counts);
  if ((place + 1) % kStretchPlaces.front() != 0) return;
  const std::size_t stretch = place / kStretchPlaces.front();
  const Position at = position(0, stretch);
  CoarseGroup& group = at.bounds->coarse[at.record / kInterleaved];
  for (std::size_t k = 0; k < kCoarseCounts; ++k) {
    const std::size_t first = k / kCountsAtOnce * kCountsAtOnce;
    group.of[first * kInterleaved + stretch % kInterleaved * kCountsAtOnce + k - first] =
        growing_coarse_.of[k];
  }
  growing_coarse_ = {};
}

}  // namespace loopbit
