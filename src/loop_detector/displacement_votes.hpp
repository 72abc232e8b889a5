// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// How often features of two images moved by each displacement, in bins a twentieth of the image's
/// width wide, up to the whole image either way.
class Displacements {
 public:
  /// Four bins, a tenth of the image's width wide; named by the number of its upper left bin.
  using Square = int;

  static constexpr int kBinsPerWidth = 20;
  static constexpr int kRows = 2 * kBinsPerWidth + 2;
  /// Bins are numbered row by row, with one more at the end of each row, which stays empty.
  static constexpr int kStride = kRows + 1;
  static constexpr int kBins = kRows * kStride;

  /// May be outside, where nothing is.
  static constexpr int moved(int bin, int right, int down) { return bin + down * kStride + right; }
  static constexpr bool is_in(int bin, Square square) {
    const int offset = bin - square;
    return offset == 0 || offset == 1 || offset == kStride || offset == kStride + 1;
  }
  static constexpr bool share_a_square(int a, int b) {
    const int apart = a < b ? b - a : a - b;
    return apart <= 1 || (apart >= kStride - 1 && apart <= kStride + 1);
  }

  Displacements() = default;
  /// `bins`: one for each displacement.
  explicit Displacements(const std::vector<int>& bins);

  [[nodiscard]] int in_square(Square square) const;
  /// The square with most displacements; of equals the first one.
  [[nodiscard]] Square fullest() const;

 private:
  std::array<std::int16_t, kBins> bins_{};
};

/// How many features of two images moved alike, at most one for each neighbourhood of the query.
struct Votes {
  int count = 0;  ///< in the fullest square of all displacements
  Displacements::Square square = 0;
  Displacements apart =
      {};  ///< of features of one neighbourhood that moved nearly alike, the first
};

/// Which features of an image are of one neighbourhood.
class Neighbourhoods {
 public:
  /// Those closer than `spacing_scales` times the smaller scale of both. `indices`: the features
  /// to be asked for.
  void find(const std::vector<Keypoint>& keypoints, const std::vector<std::int16_t>& indices,
            float spacing_scales);

  /// Of the neighbourhood of feature `index`, those before it.
  [[nodiscard]] std::span<const std::int16_t> before(int index) const {
    const auto at = static_cast<std::size_t>(index);
    return std::span(near_).subspan(begins_[at], begins_[at + 1] - begins_[at]);
  }

 private:
  struct Reach {
    float x_px;
    float y_px;
    float reach_px;
    std::int16_t index;
  };
  std::vector<Reach> by_x_;
  std::vector<std::pair<std::int16_t, std::int16_t>> pairs_;  ///< the later one first
  std::vector<std::size_t> begins_;                           ///< in near_, of each feature
  std::vector<std::int16_t> near_;
};

/// Counts votes. They need neither a ratio test nor a geometry, so they still tell places apart by
/// night. Hough voting as for weak geometric consistency (Jegou, Douze, Schmid 2008). Its memory is
/// kept from frame to frame.
class DisplacementVotes {
 public:
  explicit DisplacementVotes(double min_spacing_scales) : min_spacing_scales_(min_spacing_scales) {}

  /// Begins with a frame. `looks`: those of which count() will be asked.
  void begin(const Features& query, std::span<const FirstLook> looks);

  /// Of the frame that begin() was given: counts the query's features whose nearest of the place
  /// has no nearer one in the query, without a ratio test. Linear in the features, if they are
  /// spread. `look`: of match_strongest() for the same pair.
  Votes count(const Features& query, const Features& place, const FirstLook& look);

 private:
  /// A feature of the query, and the bin of its displacement.
  struct Moved {
    int feature = 0;
    int bin = 0;
  };

  void append_nearest(const FirstLook::Group& group, std::size_t first_query,
                      std::size_t first_place);
  void find_moved(const Features& query, const Features& place);
  template <typename MayBeOne>
  void keep_apart(const MayBeOne& may_be_one);

  double min_spacing_scales_ = 0;
  Neighbourhoods neighbourhoods_;  ///< of the query
  /// Of the features of a place: the squared distance, then the query's feature in the lower half.
  std::vector<std::uint64_t> nearest_;
  std::vector<Match> matches_;           ///< what count() counts
  std::vector<std::int16_t> looked_at_;  ///< features of the query
  std::vector<Moved> moved_;
  std::vector<int> counted_bin_;  ///< of each feature of the query, if it counts
  std::vector<int> bins_;         ///< of those that count
};

}  // namespace loopbit
