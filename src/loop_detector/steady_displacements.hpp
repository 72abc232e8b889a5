// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "candidate_verifier.hpp"
#include "wrong_paths.hpp"

namespace loopbit {

/// A robot that follows an earlier path sees everything displaced in the same way from step to
/// step. So it is known where the votes of the next place will be, and what chance gives there is
/// less than in the fullest square of all. docs/method.md, section 4, has the formulas.
class SteadyDisplacements {
 public:
  /// What a candidate shows in the square where the place before it had most votes.
  struct Seen {
    double sigmas = 0;  ///< from what other similar places show there
    double ratio = 0;   ///< see VotesRatio, over squares up to one bin away
  };

  /// The fullest square of each candidate, by step.
  using Squares = std::vector<std::pair<std::ptrdiff_t, Displacements::Square>>;
  using IsNear = std::function<bool(std::ptrdiff_t, std::ptrdiff_t)>;

  /// Of each candidate. None where the step before had no candidate one or two steps away, or where
  /// too few of the first `num_similar` candidates are elsewhere. `is_near(a, b)`: steps that show
  /// the same place. `is_step`: as in PlaceFilter::predict.
  [[nodiscard]] std::vector<std::optional<Seen>> look(
      const std::vector<VerifiedCandidate>& verified, std::size_t num_similar, bool is_step,
      const IsNear& is_near) const;

  /// How many independent witnesses one step is worth; see WrongPaths.
  [[nodiscard]] double independence() const { return wrong_.independence(); }

  /// What commit() changes.
  struct Next {
    Squares fullest = {};
    WrongPaths::Next wrong = {};
  };

  /// `wrong`: the deviations of steps where the robot is not.
  [[nodiscard]] Next prepare(Squares fullest, const ByStep& wrong) const;

  void commit(Next next) noexcept;

 private:
  [[nodiscard]] std::optional<Displacements::Square> expected(std::ptrdiff_t step,
                                                              bool is_step) const;

  Squares latest_;  ///< of the latest step
  Squares before_;  ///< of the one before it
  WrongPaths wrong_;
};

}  // namespace loopbit
