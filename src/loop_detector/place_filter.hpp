// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace loopbit {

/// The probability that the camera is at one step of an earlier path, by the way it follows it.
struct Belief {
  std::ptrdiff_t step = 0;
  double forward = 0;
  double backward = 0;

  [[nodiscard]] double mass() const { return forward + backward; }
};

/// Where the camera is: at one of the steps of earlier paths, or somewhere new. Sums to 1.
struct Beliefs {
  std::vector<Belief> steps;  ///< in order of step; only those of some mass
  double elsewhere = 1;

  [[nodiscard]] double at(std::ptrdiff_t step) const;
};

/// How much likelier a step is than a wrong place, by what the frame shows.
struct StepEvidence {
  std::ptrdiff_t step = 0;
  double log_ratio = 0;
};

/// One change of view later: along the path either way, by a number of its steps that is Poisson
/// with mean 1 (two drives along one path change the view equally often, at places of chance); the
/// way turns now and then, and with `leave_probability` the path is left. `exists(step)`: it may be
/// where the camera is.
Beliefs moved(const Beliefs& beliefs, double leave_probability,
              const std::function<bool(std::ptrdiff_t)>& exists);

/// The same without those that do not exist: for a camera at rest.
Beliefs only(const Beliefs& beliefs, const std::function<bool(std::ptrdiff_t)>& exists);

/// Whoever is somewhere new may enter an earlier path anywhere: all of its `num_steps` steps are
/// equally likely, of which only those of `evidence` are looked at.
Beliefs entered(const Beliefs& beliefs, const std::vector<StepEvidence>& evidence,
                std::ptrdiff_t num_steps);

/// Bayes' rule. `evidence`: in order of step, one a step. `share`: of the evidence that counts; a
/// frame that shows much of what the frame before showed is no second witness for that.
Beliefs updated(const Beliefs& prior, const std::vector<StepEvidence>& evidence, double share);

}  // namespace loopbit
