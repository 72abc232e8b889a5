// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/verification.hpp"

#include "agreement.hpp"
#include "distinctness.hpp"
#include "known_loops.hpp"

namespace loopbit {

/// Step 3 for the candidates of one frame after another. A first look matches only the strongest
/// keypoints of each; the few that it puts first are matched in full, and their geometry is sought
/// while it can change the decision. Others are looked at closer only where they may have what a
/// promising candidate has.
class CandidateVerifier {
 public:
  struct Query {
    const Features& features;
    bool is_step = true;  ///< it changes the view, see Agreement::score
    FrameContext context;
  };

  /// What is known of places.
  struct Places {
    std::function<const Features&(PlaceId)> features;
    std::function<std::ptrdiff_t(PlaceId)> step_of;  ///< see VerifiedCandidate::step
  };

  /// Keeps the references.
  CandidateVerifier(const LoopDetectorOptions& options, Places places, const Agreement& agreement,
                    const KnownLoops& known_loops);

  /// The candidates, in their order. Those left out have no inliers, which changes nothing now, and
  /// adds nothing to the support of later matches.
  std::vector<VerifiedCandidate> verify(const Query& query,
                                        const std::vector<Candidate>& candidates);

  /// The one with most inliers of `candidate`, one of those that verify() returned for this query,
  /// and of the places `around` it: all are the same place, or none.
  VerifiedCandidate closest(const Query& query, const VerifiedCandidate& candidate,
                            const std::vector<VerifiedCandidate>& verified,
                            std::vector<Candidate> around);

  /// The same evidence, and of the places next to `candidate` the one that is nearest as far as all
  /// of them tell. `around`: the places that may be candidates, in order, `candidate` among them,
  /// kReach beyond those that may be the answer on either side, where there are so many.
  VerifiedCandidate located(const Query& query, const VerifiedCandidate& candidate,
                            const std::vector<VerifiedCandidate>& verified,
                            const std::vector<Candidate>& around);

  /// How far a place speaks for those beside it.
  static constexpr int kReach = 2;

  /// See displacement_votes().
  int votes(const Query& query, PlaceId place);

  /// Verifies in full those that verify() left out.
  void complete(const Query& query, std::vector<VerifiedCandidate>& verified);

 private:
  struct Look {
    PlaceId place = 0;
    FirstLook found;
  };

  [[nodiscard]] Spot spot_of(const VerifiedCandidate& candidate) const;
  std::vector<double> shared_around(const Query& query, const std::vector<Candidate>& around);
  [[nodiscard]] std::vector<VerifiedCandidate> unverified(
      const std::vector<Candidate>& candidates) const;
  const FirstLook& first_look(const Query& query, PlaceId place);
  std::vector<std::size_t> by_first_look(const Query& query,
                                         const std::vector<VerifiedCandidate>& verified);
  void match(const Query& query, VerifiedCandidate& candidate, Verification& result);
  Verification& match_once(const Query& query, const std::vector<VerifiedCandidate>& verified,
                           VerifiedCandidate& candidate);
  void find_geometry(const Query& query, VerifiedCandidate& candidate, Verification& result);
  void find_distinctness(VerifiedCandidate& candidate, const Verification& result) const;
  [[nodiscard]] double highest_score(const Query& query, VerifiedCandidate candidate) const;
  void look_closer(const Query& query, std::span<const std::size_t> order,
                   std::vector<VerifiedCandidate>& verified);
  void look_at_others(const Query& query, std::span<const std::size_t> order,
                      std::vector<VerifiedCandidate>& verified);
  void note_promising(const VerifiedCandidate& candidate, const Verification& result);
  [[nodiscard]] bool is_elsewhere(const VerifiedCandidate& candidate) const;
  [[nodiscard]] std::size_t num_shared(const std::vector<Match>& matches) const;
  void note_sightings(const std::vector<VerifiedCandidate>& verified);

  const LoopDetectorOptions& options_;
  Places places_;
  const Agreement& agreement_;
  const KnownLoops& known_loops_;
  Verifier verifier_;
  std::vector<Verification> verifications_;  ///< of the candidates of this frame
  Verification verification_;                ///< of a place beside one of them
  std::vector<Look> looks_;                  ///< the first ones are of this frame
  std::size_t num_looks_ = 0;
  std::vector<Spot> promising_;          ///< where promising candidates stand
  std::vector<int> promising_features_;  ///< of the query: inliers of one of them, in order
  std::vector<Sighting> sightings_;      ///< none if no candidate is promising
};

}  // namespace loopbit
