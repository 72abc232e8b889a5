// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "loopbit/detection.hpp"

#include "candidate_verifier.hpp"
#include "known_loops.hpp"
#include "path_motion.hpp"
#include "steady_displacements.hpp"
#include "votes_ratio.hpp"
#include "wrong_paths.hpp"

namespace loopbit {

/// The probability that the robot is back at an earlier place, and at which: a discrete Bayes
/// filter over the steps of the past (changes of view) and "somewhere new". docs/method.md, section
/// 4, has the model.
///
/// Emission: what a candidate shows, displacement votes and geometry, as a likelihood ratio of "the
/// same place" against "another place". Both nulls are measured on this map: votes against what
/// similar places and those just left show this frame and what this place shows other frames,
/// inliers against what the best wrong places showed so far. Transition: the robot follows an
/// earlier path forward or backward at up to four steps per step, leaves it, or returns anywhere.
///
/// Only places that were looked at gain probability, so cost and memory of a frame do not grow with
/// the map.
class PlaceFilter {
 public:
  /// A candidate of the frame, as the filter sees it.
  struct Observed {
    Candidate candidate;
    std::ptrdiff_t step = 0;
    bool may_match = true;  ///< see VerifiedCandidate
    int num_votes = 0;      ///< of Votes
    double votes = 0;       ///< log likelihood ratio of its displacement votes
    double geometry = 0;    ///< the same of its inliers
    double sigmas = 0;      ///< votes in standard deviations of the null; 0 where there is no null
    Displacements::Square square = 0;                    ///< of Votes
    std::optional<double> steady_sigmas = std::nullopt;  ///< of SteadyDisplacements::Seen
    double excess = 0;  ///< of CandidateGeometry, 0 if it was not looked at closer

    [[nodiscard]] double log_likelihood_ratio() const;
  };

  /// What one frame tells.
  struct Update {
    Belief prior;     ///< before the frame was seen
    Belief belief;    ///< after it
    Returns returns;  ///< of the prior
    std::vector<Observed> observed;
    JustLeft just_left;  ///< with what the frame shows of them
    /// Index of the candidate that shows the same place best, if any was observed there.
    std::optional<std::size_t> match;
    bool has_null = false;   ///< there were places enough to tell what votes mean
    ScoreTerms terms;        ///< of the log odds that the match is right, if there is one
    double probability = 0;  ///< the same as a probability
    double revisit = 0;      ///< that any match is right
  };

  /// The best wrong place of each frame so far, in inliers beyond chance: how often there are any,
  /// and `excess` / `count` on average. Frames count as far as the robot was somewhere new.
  struct Tail {
    double seen;    ///< frames with any
    double unseen;  ///< frames with none
    double excess;  ///< the sum over `count` frames
    double count;   ///< as `seen`, with a prior of its own
  };

  /// Steps so close, or laps through one place, show the same place.
  static bool is_near(std::ptrdiff_t a, std::ptrdiff_t b, const KnownLoops& loops);

  /// Of the candidates that show the place at `middle`, the one that is the match: it has most in
  /// common with the frame, as far as it is probable. Where both votes and inliers prefer another
  /// view of the place, it is chosen there.
  static std::optional<std::size_t> match_near(std::ptrdiff_t middle,
                                               const std::vector<Observed>& observed,
                                               const Belief& belief, const KnownLoops& loops);

  /// To about a billionth: mathematical functions may differ in the last bit between processors,
  /// and answers must not.
  static double rounded(double value);

  /// The frame to come, before it is seen. `is_step`: it changes the view; otherwise it stands for
  /// the last step. `agreement`: null = there is no odometry.
  [[nodiscard]] Belief predict(bool is_step, const AgreementOfMoves& agreement = {}) const;

  /// The steps with most probability, at least `min_probability`, far enough apart to be different
  /// paths, and at most `most`.
  static std::vector<std::ptrdiff_t> likeliest(const Belief& belief, double min_probability,
                                               std::size_t most);

  /// What is known besides the candidates.
  struct Steps {
    std::ptrdiff_t number = 0;                            ///< of those that may be candidates
    std::function<bool(std::ptrdiff_t)> may_be_at;        ///< false for those that are excluded
    std::function<double(std::ptrdiff_t)> return_weight;  ///< see returns_to()
    bool is_step = true;                                  ///< see predict()
    std::vector<int> votes_just_left = {};                ///< of places that the robot just left
  };

  /// `verified`: the candidates of the frame; the first `num_similar` look most alike.
  [[nodiscard]] Update update(Belief prior, const std::vector<VerifiedCandidate>& verified,
                              std::size_t num_similar, const Steps& known,
                              const KnownLoops& loops) const;

  /// The probability that a place is right which shows this, if nothing else is known.
  [[nodiscard]] double probability_alone(const CandidateGeometry& geometry,
                                         std::ptrdiff_t num_steps) const;

  /// What commit() changes.
  struct Next {
    Belief before = {};
    Belief belief = {};
    ByStep sigmas = {};
    std::vector<double> shown = {};  ///< what is added for each of `sigmas`
    WrongPaths::Next votes = {};
    SteadyDisplacements::Next steady = {};
    JustLeft just_left = {};
    Tail tail = {};
    Followed followed = {};
    double products = 0;
    double squares = 0;
    bool is_step = false;
    bool has_null = false;
  };

  /// Learns what wrong places show, and takes the memory that commit() needs. Changes no answer.
  Next prepare(Update update, bool is_step, const KnownLoops& loops);

  /// Makes `next` the present state.
  void commit(Next next) noexcept;

  /// Forgets that the robot may be near `step`.
  void withdraw(std::ptrdiff_t step, const KnownLoops& loops);

 private:
  /// The running sum of what a place shows frames of other places.
  struct Shown {
    double sum = 0;
    int count = 0;
  };

  void observe(const std::vector<VerifiedCandidate>& verified, std::size_t num_similar,
               const Steps& known, const KnownLoops& loops, Update& update) const;
  [[nodiscard]] std::vector<double> deviations(const std::vector<VerifiedCandidate>& verified,
                                               std::size_t num_similar,
                                               const std::vector<int>& votes_just_left,
                                               JustLeft& just_left) const;
  [[nodiscard]] double mean_shown(std::ptrdiff_t step) const;
  [[nodiscard]] double geometry_independence() const;
  [[nodiscard]] double votes_log_ratio(
      double sigmas, std::size_t num_null,
      const std::optional<SteadyDisplacements::Seen>& steady) const;
  [[nodiscard]] double geometry_log_ratio(const CandidateGeometry& geometry,
                                          std::ptrdiff_t num_steps) const;
  [[nodiscard]] Followed followed_until(const Belief& belief) const;
  void learn(const Update& update, const KnownLoops& loops, Next& next) const;
  void learn_steady(const Update& update, std::vector<Observed> wrong, Next& next) const;

  Belief before_;  ///< predicted for the last step
  Belief belief_;  ///< of the last frame
  Followed followed_;
  ByStep latest_sigmas_;
  std::unordered_map<std::ptrdiff_t, Shown> shown_;  ///< by step
  WrongPaths votes_;                                 ///< their deviations
  SteadyDisplacements steady_;
  JustLeft just_left_;
  /// Prior: one frame in 11 has any, and ten frames had one each.
  Tail tail_{.seen = 1, .unseen = 10, .excess = 10, .count = 10};
  /// Of the products of successive deviations along paths of wrong places, and of squares. Prior: a
  /// correlation of 1/2.
  FadingSum same_path_products_{100};
  FadingSum same_path_squares_{200};
};

}  // namespace loopbit
