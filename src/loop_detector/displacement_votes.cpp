// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "displacement_votes.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace loopbit {
namespace {

/// Nearest features may differ in scale by an octave, from one level of the pyramid to the next.
constexpr float kMaxScaleRatio = 2.0F;
constexpr int kNoBin = -1;

/// std::floor() is a call where the processor's own instruction may be missing.
int floor_of(float value) {
  const int whole = static_cast<int>(value);
  return whole - (value < static_cast<float>(whole) ? 1 : 0);
}

int bin_of(const Keypoint& a, const Keypoint& b, float bin_px) {
  constexpr int kRows = Displacements::kRows;
  if (a.scale > kMaxScaleRatio * b.scale || b.scale > kMaxScaleRatio * a.scale) return kNoBin;
  const int x = floor_of((a.x_px - b.x_px) / bin_px) + kRows / 2;
  const int y = floor_of((a.y_px - b.y_px) / bin_px) + kRows / 2;
  const bool is_in = 0 <= x && x < kRows && 0 <= y && y < kRows;
  return is_in ? Displacements::moved(0, x, y) : kNoBin;
}

}  // namespace

Displacements::Displacements(const std::vector<int>& bins) {
  for (const int bin : bins) ++bins_.at(static_cast<std::size_t>(bin));
}

int Displacements::in_square(Square square) const {
  int sum = 0;
  for (const int bin : {square, square + 1, square + kStride, square + kStride + 1}) {
    if (0 <= bin && bin < kBins) sum += bins_[static_cast<std::size_t>(bin)];
  }
  return sum;
}

Displacements::Square Displacements::fullest() const {
  constexpr std::size_t kSquares = kBins - kStride - 1;
  std::array<std::int16_t, kSquares> squares;  // NOLINT(*-member-init): written next
  std::int16_t most = 0;
  for (std::size_t i = 0; i < kSquares; ++i) {
    squares[i] = static_cast<std::int16_t>(bins_[i] + bins_[i + 1] + bins_[i + kStride] +
                                           bins_[i + kStride + 1]);
    most = std::max(most, squares[i]);
  }
  return static_cast<Square>(std::ranges::find(squares, most) - squares.begin());
}

void DisplacementVotes::append_nearest(const FirstLook::Group& group, std::size_t first_query,
                                       std::size_t first_place) {
  if (group.num_query == 0) return;
  nearest_.assign(group.num_place, std::numeric_limits<std::uint64_t>::max());
  for (std::size_t i = 0; i < group.nearest.size(); ++i) {
    const FirstLook::Neighbours& found = group.nearest[i];
    std::uint64_t& known = nearest_[static_cast<std::size_t>(found.index)];
    known = std::min(known, static_cast<std::uint64_t>(found.distance_sq) << 32U | i);
  }
  // Which features are kept is hard to foresee: writing each takes no branch.
  std::size_t kept = matches_.size();
  matches_.resize(kept + group.nearest.size());
  for (std::size_t i = 0; i < group.nearest.size(); ++i) {
    const auto at = static_cast<std::size_t>(group.nearest[i].index);
    matches_[kept] = {static_cast<int>(first_query + i), static_cast<int>(first_place + at)};
    kept += static_cast<std::uint32_t>(nearest_[at]) == i ? 1U : 0U;
  }
  matches_.resize(kept);
}

void Neighbourhoods::find(const std::vector<Keypoint>& keypoints,
                          const std::vector<std::int16_t>& indices, float spacing_scales) {
  by_x_.clear();
  for (const std::int16_t index : indices) {
    const Keypoint& keypoint = keypoints[static_cast<std::size_t>(index)];
    by_x_.push_back({keypoint.x_px, keypoint.y_px, spacing_scales * keypoint.scale, index});
  }
  std::ranges::sort(by_x_, {}, [](const Reach& r) { return std::pair(r.x_px, r.index); });
  pairs_.clear();
  for (auto here = by_x_.begin(); here != by_x_.end(); ++here) {
    for (auto there = here + 1; there != by_x_.end(); ++there) {
      const float dx = there->x_px - here->x_px;
      if (dx >= here->reach_px) break;
      const float dy = there->y_px - here->y_px;
      const float reach = std::min(here->reach_px, there->reach_px);
      if (dx * dx + dy * dy >= reach * reach) continue;
      pairs_.emplace_back(std::max(here->index, there->index), std::min(here->index, there->index));
    }
  }
  // A counting sort by the later feature. While its group is filled, begins_[later + 1] is the end
  // of the group so far; in the end begins_[i] is where the group of feature i begins.
  begins_.assign(keypoints.size() + 2, 0);
  for (const auto& [later, earlier] : pairs_) ++begins_[static_cast<std::size_t>(later) + 2];
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  near_.resize(pairs_.size());
  for (const auto& [later, earlier] : pairs_) {
    near_[begins_[static_cast<std::size_t>(later) + 1]++] = earlier;
  }
}

void DisplacementVotes::begin(const Features& query, std::span<const FirstLook> looks) {
  std::size_t num_dark = 0;
  std::size_t num_bright = 0;
  for (const FirstLook& look : looks) {
    num_dark = std::max(num_dark, look.dark.num_query);
    num_bright = std::max(num_bright, look.bright.num_query);
  }
  looked_at_.resize(num_dark + num_bright);
  const auto first_bright = looked_at_.begin() + static_cast<std::ptrdiff_t>(num_dark);
  std::iota(looked_at_.begin(), first_bright, std::int16_t{0});
  std::iota(first_bright, looked_at_.end(), static_cast<std::int16_t>(query.num_dark));
  neighbourhoods_.find(query.keypoints, looked_at_, static_cast<float>(min_spacing_scales_));
  counted_bin_.assign(query.keypoints.size(), kNoBin);
}

Votes DisplacementVotes::count(const Features& query, const Features& place,
                               const FirstLook& look) {
  matches_.clear();
  append_nearest(look.dark, 0, 0);
  append_nearest(look.bright, query.num_dark, place.num_dark);
  find_moved(query, place);
  bins_.clear();
  for (const Moved& moved : moved_) bins_.push_back(moved.bin);
  Votes votes{.square = Displacements(bins_).fullest()};
  keep_apart(Displacements::share_a_square);
  votes.apart = Displacements(bins_);
  std::erase_if(moved_,
                [&](const Moved& moved) { return !Displacements::is_in(moved.bin, votes.square); });
  keep_apart([](int /*a*/, int /*b*/) { return true; });
  votes.count = static_cast<int>(bins_.size());
  return votes;
}

void DisplacementVotes::find_moved(const Features& query, const Features& place) {
  const float bin_px =
      static_cast<float>(query.working_size_px.width) / Displacements::kBinsPerWidth;
  moved_.clear();
  for (const Match& match : matches_) {
    const auto bin = bin_of(query.keypoint(match.query), place.keypoint(match.place), bin_px);
    if (bin != kNoBin) moved_.push_back({match.query, bin});
  }
}

/// Of those in `moved_`, only those count that have none of their neighbourhood before them that
/// `may_be_one(bin, its bin)`.
template <typename MayBeOne>
void DisplacementVotes::keep_apart(const MayBeOne& may_be_one) {
  bins_.clear();
  for (const Moved& moved : moved_) {
    const bool is_new = std::ranges::none_of(neighbourhoods_.before(moved.feature), [&](int other) {
      const int counted = counted_bin_[static_cast<std::size_t>(other)];
      return counted != kNoBin && may_be_one(moved.bin, counted);
    });
    if (!is_new) continue;
    counted_bin_[static_cast<std::size_t>(moved.feature)] = moved.bin;
    bins_.push_back(moved.bin);
  }
  for (const Moved& moved : moved_) {
    counted_bin_[static_cast<std::size_t>(moved.feature)] = kNoBin;
  }
}

}  // namespace loopbit
