// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "candidate_verifier.hpp"
#include "places.hpp"

namespace loopbit {

/// The working memory of one call of a detector.
struct Workspace {
  Workspace(const LoopDetectorOptions& options, const Places& places)
      : surf(options.surf), verifier(options.verification), candidates(options, places, held) {}

  SurfExtractor surf;
  Verifier verifier;
  Verification verification;  ///< of the query and a recent place
  PlaceMemory::Held held;
  CandidateVerifier candidates;
};

/// Gives each call a Workspace of its own, which later calls use again. Any thread may ask.
class Workspaces {
 public:
  explicit Workspaces(std::function<std::unique_ptr<Workspace>()> make) : make_(std::move(make)) {}

  struct GiveBack {
    Workspaces* to = nullptr;
    void operator()(Workspace* workspace) const { to->give_back(workspace); }
  };
  using Lease = std::unique_ptr<Workspace, GiveBack>;

  Lease take() {
    std::unique_ptr<Workspace> workspace;
    {
      const std::scoped_lock lock(mutex_);
      if (free_.empty()) {
        free_.reserve(num_made_ + 1);  // so that giving it back does not throw
        ++num_made_;
      } else {
        workspace = std::move(free_.back());
        free_.pop_back();
      }
    }
    if (!workspace) workspace = make_();
    workspace->held.clear();
    return {workspace.release(), {this}};
  }

 private:
  void give_back(Workspace* workspace) {
    std::unique_ptr<Workspace> free(workspace);
    const std::scoped_lock lock(mutex_);
    free_.push_back(std::move(free));
  }

  std::function<std::unique_ptr<Workspace>()> make_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> free_;
  std::size_t num_made_ = 0;
};

}  // namespace loopbit
