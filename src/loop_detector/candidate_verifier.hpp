// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/verification.hpp"

#include "displacement_votes.hpp"
#include "distinctness.hpp"
#include "places.hpp"

namespace loopbit {

/// What matching and epipolar geometry found for one candidate.
struct CandidateGeometry {
  int matches = 0;
  std::vector<Match> inliers = {};
  int distinct_inliers = 0;
  double inlier_worth = 1;  ///< 0 to 1, see inlier_worth()
  double distinctness = 1;  ///< 0 to 1, see distinctness()
  int chance_inliers = 8;   ///< see chance_inliers(); that of pixels

  /// That it shows the same place, in distinct inliers that count in full.
  [[nodiscard]] double evidence() const { return distinct_inliers * inlier_worth * distinctness; }
  /// The part of `share` of it that is more than chance; negative below.
  [[nodiscard]] double excess(double share = 1) const {
    return share * evidence() - chance_inliers;
  }
};

/// One candidate of one frame.
struct VerifiedCandidate {
  Candidate candidate;
  std::ptrdiff_t step = 0;  ///< the candidate's, see Places
  bool may_match = true;    ///< false: it only shows what wrong places have
  Votes votes = {};
  std::optional<CandidateGeometry> geometry = std::nullopt;  ///< if it may be more than chance
};

/// What one distinct inlier counts, 0 to 1. `explained_share`: see there. `view_inliers`: distinct
/// inliers that the query shares with the change of view before, which is what can be recognised of
/// it: the same number found elsewhere says less of a view that has more.
double inlier_worth(double explained_share, int view_inliers);

/// Step 3 for the candidates of one frame. A first look matches the strongest keypoints of each and
/// counts displacement votes; the few that it puts first are matched in full, with their geometry.
/// Others are looked at closer only where they may have what a promising candidate has. Keeps
/// nothing from frame to frame but its memory.
class CandidateVerifier {
 public:
  struct Query {
    const Features& features;
    int view_inliers = 0;  ///< see inlier_worth()
    bool closely = false;  ///< the first look matches all keypoints, not only the strongest
    const CameraModel* camera = nullptr;  ///< see epipolar_inliers()
    PlaceTest may_match = {};             ///< empty = all may; the others are only looked at once
  };

  /// Keeps the references. `held` takes the features that it reads from a map.
  CandidateVerifier(const LoopDetectorOptions& options, const Places& places,
                    PlaceMemory::Held& held);

  /// The candidates, in their order. The first `num_similar` look most alike, the others are where
  /// the robot is expected; the best few of both are looked at closer.
  std::vector<VerifiedCandidate> verify(const Query& query,
                                        const std::vector<Candidate>& candidates,
                                        std::size_t num_similar);

  /// Matches in full those that verify() left out.
  void complete(const Query& query, std::vector<VerifiedCandidate>& verified);

 private:
  /// The candidates of one frame and what was found for each.
  struct Frame;

  void look(Frame& frame);
  void look_closer(Frame& frame, std::size_t first, std::size_t last, std::size_t most);
  void look_at_others(Frame& frame);
  void verify_in_full(Frame& frame, std::size_t i, bool even_if_chance);
  std::optional<CandidateGeometry> geometry_of(const Query& query, PlaceId place,
                                               const FirstLook& look, bool even_if_chance);
  [[nodiscard]] Spot spot_of(const VerifiedCandidate& candidate) const;
  [[nodiscard]] bool is_elsewhere(const Frame& frame, const VerifiedCandidate& candidate) const;
  void find_distinctness(Frame& frame) const;

  const LoopDetectorOptions& options_;
  const Places& places_;
  PlaceMemory::Held& held_;
  Verifier verifier_;
  DisplacementVotes votes_;
  std::vector<FirstLook> looks_;
  Verification verification_;
};

}  // namespace loopbit
