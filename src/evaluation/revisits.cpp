// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/revisits.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

namespace loopbit {
namespace {

/// Loops of one revisit are at most so many frames apart.
constexpr int kMaxGap = 20;

/// Adds it to the nearest of `groups`, or as a new one.
void add(std::vector<Revisit>& groups, const ReportedMatch& loop) {
  const auto distance = [&](const Revisit& group) {
    return std::abs(loop.match - group.last_match);
  };
  const auto nearest = std::min_element(
      groups.begin(), groups.end(),
      [&](const Revisit& a, const Revisit& b) { return distance(a) < distance(b); });
  if (nearest == groups.end() || distance(*nearest) > kMaxGap) {
    groups.push_back({loop.query, loop.query, loop.match, loop.match, 1});
    return;
  }
  nearest->last_query = loop.query;
  nearest->last_match = loop.match;
  ++nearest->loops;
}

}  // namespace

std::vector<Revisit> revisits(const MatchList& list) {
  std::vector<ReportedMatch> loops;
  std::copy_if(list.matches.begin(), list.matches.end(), std::back_inserter(loops),
               [](const ReportedMatch& match) { return match.is_loop; });
  std::sort(loops.begin(), loops.end(), [](const ReportedMatch& a, const ReportedMatch& b) {
    return std::pair(a.query, a.match) < std::pair(b.query, b.match);
  });
  std::vector<Revisit> groups;
  std::vector<Revisit> open;  // those that another loop may still belong to
  for (const ReportedMatch& loop : loops) {
    const auto closed = std::stable_partition(open.begin(), open.end(), [&](const Revisit& group) {
      return loop.query - group.last_query <= kMaxGap;
    });
    groups.insert(groups.end(), closed, open.end());
    open.erase(closed, open.end());
    add(open, loop);
  }
  groups.insert(groups.end(), open.begin(), open.end());
  std::sort(groups.begin(), groups.end(), [](const Revisit& a, const Revisit& b) {
    return std::pair(a.first_query, a.first_match) < std::pair(b.first_query, b.first_match);
  });
  return groups;
}

}  // namespace loopbit
