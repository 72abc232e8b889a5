// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "displacement_votes.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace loopbit {
namespace {

/// Of a feature nearest to each other on two levels of the pyramid, which are an octave apart.
constexpr float kMaxScaleRatio = 2.0F;
/// Displacements up to the whole image either way; a square of four bins is a tenth of its width.
constexpr int kBinsPerWidth = 20;
constexpr int kBins = 2 * kBinsPerWidth + 2;
/// Bins are numbered row by row, with one more at the end of each row, which stays empty.
constexpr int kBinStride = kBins + 1;
constexpr std::int16_t kNoBin = -1;

using Bins = std::array<std::int16_t, std::size_t{kBins} * kBinStride>;

/// std::floor() is a call where the processor's own instruction may be missing.
int floor_of(float value) {
  const int whole = static_cast<int>(value);
  return whole - (value < static_cast<float>(whole) ? 1 : 0);
}

std::int16_t bin_of(const Keypoint& a, const Keypoint& b, float bin_px) {
  if (a.scale > kMaxScaleRatio * b.scale || b.scale > kMaxScaleRatio * a.scale) return kNoBin;
  const int x = floor_of((a.x_px - b.x_px) / bin_px) + kBins / 2;
  const int y = floor_of((a.y_px - b.y_px) / bin_px) + kBins / 2;
  const bool is_in = 0 <= x && x < kBins && 0 <= y && y < kBins;
  return is_in ? static_cast<std::int16_t>(y * kBinStride + x) : kNoBin;
}

/// The upper left bin of the square of four with most displacements; of equals the first one.
std::int16_t fullest_square(const std::vector<std::int16_t>& bins) {
  Bins displacements{};
  for (const std::int16_t bin : bins) {
    if (bin != kNoBin) ++displacements[static_cast<std::size_t>(bin)];
  }
  constexpr std::size_t kSquares = Bins{}.size() - kBinStride - 1;
  Bins squares;  // NOLINT(cppcoreguidelines-pro-type-member-init): written next
  std::int16_t most = 0;
  for (std::size_t i = 0; i < kSquares; ++i) {
    squares[i] = static_cast<std::int16_t>(displacements[i] + displacements[i + 1] +
                                           displacements[i + kBinStride] +
                                           displacements[i + kBinStride + 1]);
    most = std::max(most, squares[i]);
  }
  const auto* fullest = std::find(squares.begin(), squares.begin() + kSquares, most);
  return static_cast<std::int16_t>(fullest - squares.begin());
}

bool is_in_square(std::int16_t bin, std::int16_t square) {
  const int offset = bin - square;
  return offset == 0 || offset == 1 || offset == kBinStride || offset == kBinStride + 1;
}

const Keypoint& keypoint_of(const Features& features, int index) {
  return features.keypoints[static_cast<std::size_t>(index)];
}

}  // namespace

void DisplacementVotes::append_nearest(const FirstLook::Group& group, std::size_t first_query,
                                       std::size_t first_place) {
  if (group.num_query == 0) return;
  nearest_.assign(group.num_place, {std::numeric_limits<std::int32_t>::max(), -1});
  for (std::size_t i = 0; i < group.nearest.size(); ++i) {
    const FirstLook::Neighbours& found = group.nearest[i];
    Nearest& known = nearest_[static_cast<std::size_t>(found.index)];
    if (found.distance_sq < known.distance_sq) {
      known = {found.distance_sq, static_cast<std::int32_t>(i)};
    }
  }
  for (std::size_t i = 0; i < group.nearest.size(); ++i) {
    const auto at = static_cast<std::size_t>(group.nearest[i].index);
    if (nearest_[at].query != static_cast<std::int32_t>(i)) continue;
    matches_.push_back({static_cast<int>(first_query + i), static_cast<int>(first_place + at)});
  }
}

const std::vector<Match>& DisplacementVotes::nearest_matches(const Features& query,
                                                             const Features& place,
                                                             const FirstLook& look) {
  matches_.clear();
  append_nearest(look.dark, 0, 0);
  append_nearest(look.bright, query.num_dark, place.num_dark);
  return matches_;
}

void DisplacementVotes::find_bins(const Features& query, const Features& place) {
  const float bin_px = static_cast<float>(query.working_size_px.width) / kBinsPerWidth;
  bins_.resize(matches_.size());
  std::transform(matches_.begin(), matches_.end(), bins_.begin(), [&](const Match& match) {
    return bin_of(keypoint_of(query, match.query), keypoint_of(place, match.place), bin_px);
  });
}

int DisplacementVotes::count(const Features& query, const Features& place, const FirstLook& look) {
  nearest_matches(query, place, look);
  find_bins(query, place);
  const std::int16_t square = fullest_square(bins_);
  counted_.clear();
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    if (bins_[i] == kNoBin || !is_in_square(bins_[i], square)) continue;
    const Keypoint& here = keypoint_of(query, matches_[i].query);
    const bool is_new = std::none_of(counted_.begin(), counted_.end(), [&](const Keypoint& other) {
      const double dx = here.x_px - other.x_px;
      const double dy = here.y_px - other.y_px;
      const double spacing = min_spacing_scales_ * std::min(here.scale, other.scale);
      return dx * dx + dy * dy < spacing * spacing;
    });
    if (is_new) counted_.push_back(here);
  }
  return static_cast<int>(counted_.size());
}

}  // namespace loopbit
