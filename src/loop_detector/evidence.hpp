// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "loopbit/place_index.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// What wrong places show: where most values lie, how far they spread, and how well that spread is
/// known (degrees of freedom: few while the map is small).
struct Null {
  double middle = 0;
  double spread = 1;
  double freedom = 1;
};

/// Log of how much likelier `value` is at the right place than at a wrong one. All that is said of
/// the right place is that it shows more: with u the chance that a wrong place shows as much
/// (Student's t), the ratio is the mean of k u^(k-1) over all k from 0 to 1, which is
/// (1 - u + u ln u) / (u ln^2 u). Its mean over wrong places is 1, so it cannot mislead in the long
/// run, whatever the right place shows; it is never below 1/2.
double log_likelihood_ratio(double value, const Null& null);

/// The same for the median of wrong places: that of a place that was not looked at.
double log_ratio_of_unseen();

/// Matches that fit one epipolar geometry by chance: seven always do, and one in twelve of the rest
/// of random ones.
double chance_inliers(std::size_t matches);

/// One place as one frame shows it.
struct LookedAt {
  Candidate candidate;
  std::ptrdiff_t step = 0;    ///< where it lies along the path, see RecentView::step_of
  bool is_listed = true;      ///< retrieval named it; else the path did
  std::vector<Match> shared;  ///< of the strongest features
  double root = 0;            ///< of their number, less what the place shows other frames
  double content_log_ratio = 0;
  double matching_log_ratio = 0;
  std::optional<Verification> verification;  ///< of those looked at closer
  double geometry_log_ratio = 0;

  [[nodiscard]] double log_ratio() const {
    return content_log_ratio + matching_log_ratio + geometry_log_ratio;
  }
  /// Inliers beyond chance.
  [[nodiscard]] double excess() const;
};

/// What wrong places show on this map, learned from frame to frame: the row (the other candidates
/// of a frame), the column (what a place shows other frames), and the best geometry of frames that
/// were no loops.
class NullModel {
 public:
  /// What a frame adds; see learn().
  struct Lesson {
    double root_middle = 0;
    double root_spread_sq = 0;
    double content_spread_sq = 0;
    double places = 0;  ///< that the spreads come from
    double root_spread = 0;
  };

  /// Sets the root of each of `places`, and the evidence of content and of shared features.
  Lesson weigh(std::vector<LookedAt>& places) const;

  /// Sets the evidence of geometry of a place that was verified.
  void weigh_geometry(LookedAt& place) const;

  /// Takes the memory that the next place needs, so that add_place() does not throw.
  void reserve_next(std::size_t places);
  /// The map has so many places now. Does not throw after reserve_next().
  void set_size(std::size_t places) { columns_.resize(places); }

  /// Learns from a change of view. `doubt(place)`: the probability that it is a wrong place. Does
  /// not throw.
  template <typename Doubt>
  void learn(const Lesson& lesson, const std::vector<LookedAt>& places, const Doubt& doubt) {
    learn_rows(lesson);
    double weight = 1;
    double excess = 0;
    for (const LookedAt& place : places) {
      const double doubted = doubt(place);
      learn_column(lesson, place, doubted);
      if (place.excess() == 0) continue;
      if (doubted * place.excess() * place.excess() <= weight * excess * excess && excess > 0) {
        continue;
      }
      weight = doubted;
      excess = place.excess();
    }
    excess_sq_ += weight * excess * excess;
    excess_frames_ += weight;
  }

 private:
  struct Column {
    float sum = 0;    ///< of how far its roots lay above those of other places
    float count = 0;  ///< frames that looked at it
  };

  void learn_rows(const Lesson& lesson);
  void learn_column(const Lesson& lesson, const LookedAt& place, double weight);

  std::vector<Column> columns_;  ///< by place
  double root_sq_ = 0;
  double content_sq_ = 0;
  double row_weight_ = 0;
  double excess_sq_ = 0;
  double excess_frames_ = 0;
};

}  // namespace loopbit
