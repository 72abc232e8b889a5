// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "thinning.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <queue>
#include <utility>

#include "loopbit/place_index.hpp"

namespace loopbit {
namespace {

using FrameKey = std::pair<int, int>;

FrameKey key_of(const SessionFrame& at) { return {at.session, at.frame}; }

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

class Thinning {
 public:
  explicit Thinning(const std::vector<ThinnedPlace>& places)
      : places_(places), nodes_(places.size()) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const bool continues = i > 0 && places[i - 1].session == places[i].session;
      if (!continues) continue;
      nodes_[i].previous = i - 1;
      nodes_[i - 1].next = i;
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].loop) nodes_[*places[i].loop].loops_to_it.push_back(i);
    }
    for (std::size_t i = 0; i < places.size(); ++i) assess(i);
  }

  std::vector<bool> kept(std::size_t max_places) {
    std::size_t size = places_.size();
    while (size > max_places && !cheapest_.empty()) {
      const auto [cost, place] = cheapest_.top();
      cheapest_.pop();
      if (nodes_[place].removed || nodes_[place].cost != cost) continue;  // assessed anew since
      remove(place);
      --size;
    }
    std::vector<bool> kept(places_.size());
    for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = !nodes_[i].removed;
    return kept;
  }

 private:
  struct Node {
    std::size_t previous = kNone;  ///< the previous kept place of the session
    std::size_t next = kNone;
    std::size_t substitute = kNone;  ///< the place that can represent it
    double cost = 0;
    double owed = 0;  ///< the largest cost of the places that it represents
    std::vector<std::size_t> loops_to_it;
    bool removed = false;
  };

  /// Finds the place that can represent this one, and the cost of dropping it.
  void assess(std::size_t i) {
    Node& node = nodes_[i];
    if (node.removed) return;
    double best = -1.0;
    for (const std::size_t other : {node.previous, node.next, places_[i].loop.value_or(kNone)}) {
      if (other == kNone || nodes_[other].removed) continue;
      const double xi = similarity(places_[i].content, places_[other].content,
                                   RetrievalOptions{}.shift_tolerance_columns);
      if (xi <= best) continue;
      best = xi;
      node.substitute = other;
    }
    constexpr double kIrreplaceable = 1e6;
    node.cost = (best < 0 ? kIrreplaceable : 1.0 - best) + node.owed;
    cheapest_.emplace(node.cost, i);
  }

  void remove(std::size_t i) {
    Node& node = nodes_[i];
    node.removed = true;
    if (node.previous != kNone) nodes_[node.previous].next = node.next;
    if (node.next != kNone) nodes_[node.next].previous = node.previous;
    if (node.substitute != kNone && !nodes_[node.substitute].removed) {
      Node& substitute = nodes_[node.substitute];
      substitute.owed = std::max(substitute.owed, node.cost);
      assess(node.substitute);
    }
    for (const std::size_t other : {node.previous, node.next}) {
      if (other != kNone && other != node.substitute) assess(other);
    }
    for (const std::size_t other : node.loops_to_it) assess(other);
  }

  using Cost = std::pair<double, std::size_t>;

  const std::vector<ThinnedPlace>& places_;
  std::vector<Node> nodes_;
  std::priority_queue<Cost, std::vector<Cost>, std::greater<>> cheapest_;
};

}  // namespace

std::vector<bool> kept_places(const std::vector<ThinnedPlace>& places, std::size_t max_places) {
  return Thinning(places).kept(max_places);
}

std::set<std::int64_t> remaining_places(MapReader& map, const CompactOptions& options) {
  const std::set<int> dropped(options.drop_sessions.begin(), options.drop_sessions.end());
  std::vector<ThinnedPlace> places;
  std::vector<std::int64_t> ids;
  std::map<FrameKey, std::size_t> index;
  map.for_each_place([&](const MapPlace& place) {
    if (dropped.contains(place.at.session)) return;
    index[key_of(place.at)] = places.size();
    places.push_back({place.content, place.at.session});
    ids.push_back(place.id);
  });
  if (options.max_places > 0) {
    for (const MapLoop& loop : map.loops()) {
      const auto query = index.find(key_of(loop.query));
      const auto match = index.find(key_of(loop.match));
      if (query != index.end() && match != index.end() && query != match) {
        places[query->second].loop = match->second;
      }
    }
    const auto kept = kept_places(places, static_cast<std::size_t>(options.max_places));
    std::size_t position = 0;
    std::erase_if(ids, [&](std::int64_t) { return !kept[position++]; });
  }
  return {ids.begin(), ids.end()};
}

}  // namespace loopbit
