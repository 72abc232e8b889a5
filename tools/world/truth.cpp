// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "truth.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "chance.hpp"

namespace loopbit::town {
namespace {

constexpr double kSameHeight_m = 1.0;  // much less than a storey

/// Frames by square of the plane. Squares are as wide as the rule reaches, so that nine of them
/// contain all frames that can match.
class Squares {
 public:
  explicit Squares(double width_m) : width_m_(width_m) {}

  void add(Vec2 at, int frame) { frames_[key(cell(at.x), cell(at.y))].push_back(frame); }

  template <typename Visit>
  void for_each_near(Vec2 at, const Visit& visit) const {
    for (int y = cell(at.y) - 1; y <= cell(at.y) + 1; ++y) {
      for (int x = cell(at.x) - 1; x <= cell(at.x) + 1; ++x) {
        const auto found = frames_.find(key(x, y));
        if (found == frames_.end()) continue;
        for (const int frame : found->second) visit(frame);
      }
    }
  }

 private:
  [[nodiscard]] int cell(double value) const { return floor_int(value / width_m_); }

  static std::uint64_t key(int x, int y) {
    return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32) |
           static_cast<std::uint32_t>(y);
  }

  double width_m_;
  std::unordered_map<std::uint64_t, std::vector<int>> frames_;
};

bool same_place(const View& a, const View& b, const PlaceRule& rule) {
  const Vec2 apart = a.at - b.at;
  if (dot(apart, apart) > rule.distance_m * rule.distance_m) return false;
  if (!rule.ramps && (a.on_ramp || b.on_ramp)) return false;
  if (std::abs(a.height_m - b.height_m) > kSameHeight_m) return false;
  const double cos_turn = dot(a.forward, b.forward);
  return (rule.opposite ? std::abs(cos_turn) : cos_turn) >= rule.cos_turn;
}

void append_runs(int query, std::vector<int>& frames, std::vector<PlaceRun>& runs) {
  std::sort(frames.begin(), frames.end());
  bool open = false;
  for (const int frame : frames) {
    if (open && runs.back().last + 1 == frame) {
      runs.back().last = frame;
    } else {
      runs.push_back({query, frame, frame});
    }
    open = true;
  }
}

}  // namespace

std::vector<PlaceRun> find_places(const std::vector<View>& views, const PlaceRule& rule) {
  Squares squares(rule.distance_m);
  std::vector<PlaceRun> runs;
  std::vector<int> frames;
  for (int query = 0; query < static_cast<int>(views.size()); ++query) {
    const View& view = views[static_cast<std::size_t>(query)];
    const int newest = query - rule.frames_between;
    if (newest >= 0) squares.add(views[static_cast<std::size_t>(newest)].at, newest);
    frames.clear();
    squares.for_each_near(view.at, [&](int frame) {
      if (same_place(view, views[static_cast<std::size_t>(frame)], rule)) frames.push_back(frame);
    });
    append_runs(query, frames, runs);
  }
  return runs;
}

}  // namespace loopbit::town
