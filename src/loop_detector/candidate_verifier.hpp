// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/verification.hpp"

#include "displacement_votes.hpp"
#include "distinctness.hpp"
#include "evenness.hpp"
#include "places.hpp"

namespace loopbit {

/// What matching and epipolar geometry found for one candidate.
struct CandidateGeometry {
  int matches = 0;
  std::vector<Match> inliers = {};
  int distinct_inliers = 0;
  double inlier_worth = 1;  ///< 0 to 1, see inlier_worth()
  double view_worth = 1;    ///< 0 to 1, see view_worth()
  double distinctness = 1;  ///< 0 to 1, see distinctness()
  int chance_inliers = 8;   ///< see chance_inliers(); that of pixels

  /// That it shows the same place, in distinct inliers that count in full. `known`, 0 to 1: how
  /// well the map can show that a feature is rare; an inlier counts no more than that.
  [[nodiscard]] double evidence(double known = 1) const {
    return distinct_inliers * std::min(inlier_worth, known) * view_worth * distinctness;
  }
  /// What of it is more than chance; negative below.
  [[nodiscard]] double excess(double known = 1) const { return evidence(known) - chance_inliers; }
};

/// One candidate of one frame.
struct VerifiedCandidate {
  Candidate candidate;
  std::ptrdiff_t step = 0;  ///< the candidate's, see Places
  bool may_match = true;    ///< false: it only shows what wrong places have
  Votes votes = {};
  std::optional<CandidateGeometry> geometry = std::nullopt;  ///< if it may be more than chance
};

/// What one distinct inlier counts, 0 to 1, by the lesser of explained_share() and Evenness: both
/// are low if only a part of the image looks like a part of the other.
double inlier_worth(double explained_share, double evenness);

/// What it counts, 0.5 to 1, in a view that shares so many distinct inliers with the change of view
/// before: the same number found elsewhere says less of a view that has more.
double view_worth(int distinct_inliers);

/// Step 3 for the candidates of one frame. A first look matches the strongest keypoints of each and
/// counts displacement votes; the few that it puts first are matched in full, with their geometry.
/// Others are looked at closer only where they may have what a promising candidate has. Keeps
/// nothing from frame to frame but its memory.
class CandidateVerifier {
 public:
  struct Query {
    const Features& features;
    const SharedView& view;
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
  std::optional<CandidateGeometry> geometry_of(const Query& query, const Evenness& evenness,
                                               PlaceId place, const FirstLook& look,
                                               bool even_if_chance);
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
