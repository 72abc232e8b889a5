// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/place_index.hpp"

#include "test_support.hpp"

namespace loopbit::test {

using Contents = std::vector<BinaryContent>;

/// The rule of PlaceIndex::query as its header says it, without any shortcut: take the best place
/// that is left and may be taken, again and again.
std::vector<Candidate> full_scan(const Contents& places, const BinaryContent& query, PlaceId end,
                                 const RetrievalOptions& options, const PlaceTest& is_allowed = {});

Contents random_contents(Random& random, int num_contents);

/// A camera's way: each content is the one before with some bits changed, now and then shifted.
Contents coherent_contents(Random& random, int num_contents);

}  // namespace loopbit::test
