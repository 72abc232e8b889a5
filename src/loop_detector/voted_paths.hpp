// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "loopbit/place_index.hpp"
#include "loopbit/verification.hpp"

#include "distinctness.hpp"

namespace loopbit {

/// How many of the query's strongest features have moved alike on their way to the nearest features
/// of a place, at most one for each neighbourhood of the query: the largest number of displacements
/// in one square of a tenth of the image's width. Neither the ratio test nor a geometry is needed,
/// so something remains of it by night. Hough voting as for weak geometric consistency (Jegou,
/// Douze, Schmid 2008). `look`: of match_strongest() for the same pair. Linear in the features.
int displacement_votes(const Features& query, const Features& place, const FirstLook& look,
                       double min_spacing_scales);

/// Loops that geometry does not see, because light or season have changed too much: no feature of
/// one frame is reliable, but along an earlier path place after place has more displacement votes
/// than others have.
///
/// Each frame scores the places it was compared with in standard deviations from what equally
/// similar places have (a null that needs no constant for any kind of scene), and the scores of the
/// latest ten steps are added up along straight paths through the past, at several speeds either
/// way. A path counts by its margin over the best one elsewhere.
class VotedPaths {
 public:
  struct Votes {
    PlaceId place = 0;
    std::ptrdiff_t step = 0;  ///< see RecentView::step_of
    int votes = 0;
  };
  struct Score {
    PlaceId place = 0;
    std::ptrdiff_t step = 0;
    double sigmas = 0;
  };
  /// Of one frame, by step; of several places of one step the one with the best score.
  using Scores = std::vector<Score>;

  /// The scores of `votes`, of which the first `num_similar` were chosen for their similarity and
  /// are the null. None if they are too few to be one.
  static Scores scores(const std::vector<Votes>& votes, std::size_t num_similar);

  /// A path that ends at the next frame.
  struct Path {
    Score end;  ///< 0 deviations at a place that the frame was not compared with
    double sum = 0;
    double steps_per_step = 0;
  };
  struct Best {
    Path path;
    double margin_sigmas = 0;  ///< over the best path elsewhere, in deviations of their difference
  };

  /// To each of `latest`, the scores of the next frame, the best path that ends there, and the
  /// earlier paths that go on where the frame was not compared; the best ones first. `is_step`: the
  /// frame changes the view; else it stands for the last step.
  [[nodiscard]] std::vector<Path> paths(const Scores& latest, bool is_step) const;

  /// The first of `paths`, if there is one and the frame itself speaks for its end. `spot_of`:
  /// where a step lies.
  static std::optional<Best> best(const std::vector<Path>& paths,
                                  const std::function<Spot(std::ptrdiff_t step)>& spot_of);

  /// Notes the scores of a frame and their paths.
  void remember(Scores latest, const std::vector<Path>& paths, bool is_step);

  /// The places where the best paths so far would go on, to be looked at next: a few.
  [[nodiscard]] const std::vector<PlaceId>& expected_places() const { return expected_; }

 private:
  [[nodiscard]] double sum_along(std::ptrdiff_t end, double steps_per_step, bool is_step) const;
  [[nodiscard]] Path best_path_to(const Score& end, bool is_step) const;

  std::vector<Scores> steps_;  ///< of the latest steps, the last one last
  std::vector<Path> paths_;    ///< to the last step
  std::vector<PlaceId> expected_;
};

}  // namespace loopbit
