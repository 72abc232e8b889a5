// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/place_index.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "place_store.hpp"
#include "pruned_search.hpp"

namespace loopbit {

PlaceIndex::PlaceIndex() : store_(std::make_unique<PlaceStore>()) {}

PlaceIndex::PlaceIndex(const std::string& scratch_folder)
    : store_(std::make_unique<PlaceStore>(std::make_unique<ScratchFile>(scratch_folder))) {}

PlaceIndex::~PlaceIndex() = default;
PlaceIndex::PlaceIndex(PlaceIndex&&) noexcept = default;
PlaceIndex& PlaceIndex::operator=(PlaceIndex&&) noexcept = default;

PlaceId PlaceIndex::add(const BinaryContent& content) { return store_->add(content); }

void PlaceIndex::reserve_next() { store_->reserve_next(); }

PlaceId PlaceIndex::size() const { return store_->size(); }

const BinaryContent& PlaceIndex::content(PlaceId place) const {
  if (place < 0 || place >= size()) {
    throw std::out_of_range(fmt::format("there is no place {} among {}", place, size()));
  }
  return store_->content(static_cast<std::size_t>(place));
}

std::vector<Candidate> PlaceIndex::query(const BinaryContent& content, PlaceId end,
                                         const RetrievalOptions& options, RetrievalWork* work,
                                         const PlaceTest& is_allowed) const {
  validate(options, "retrieval");
  end = std::min(end, size());
  if (work != nullptr) *work = {};
  if (end <= 0 || count(content) == 0) return {};
  PrunedSearch search(*store_, end, content, options, active_instruction_set(), is_allowed);
  std::vector<Candidate> candidates = search.run();
  if (work != nullptr) *work = search.work();
  return candidates;
}

}  // namespace loopbit
