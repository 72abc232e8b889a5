// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// How many features of two images moved alike, at most one for each neighbourhood of the query:
/// the largest number of displacements in one square of a tenth of the image's width. It needs
/// neither a ratio test nor a geometry, so it still tells places apart by night. Hough voting as
/// for weak geometric consistency (Jegou, Douze, Schmid 2008). Its memory is kept from pair to
/// pair.
class DisplacementVotes {
 public:
  explicit DisplacementVotes(double min_spacing_scales) : min_spacing_scales_(min_spacing_scales) {}

  /// Linear in the features. `look`: of match_strongest() for the same pair.
  int count(const Features& query, const Features& place, const FirstLook& look);

  /// What count() counts: the query's features whose nearest of the place has no nearer one in the
  /// query, without a ratio test. Valid until the next call.
  const std::vector<Match>& nearest_matches(const Features& query, const Features& place,
                                            const FirstLook& look);

 private:
  struct Nearest {
    std::int32_t distance_sq = 0;
    std::int32_t query = 0;
  };

  void append_nearest(const FirstLook::Group& group, std::size_t first_query,
                      std::size_t first_place);
  void find_bins(const Features& query, const Features& place);

  double min_spacing_scales_ = 0;
  std::vector<Nearest> nearest_;  ///< of the features of a place
  std::vector<Match> matches_;
  std::vector<std::int16_t> bins_;  ///< of each match
  std::vector<Keypoint> counted_;
};

}  // namespace loopbit
