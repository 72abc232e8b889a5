// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <list>
#include <optional>
#include <vector>

#include "known_loops.hpp"
#include "place_filter.hpp"

namespace loopbit {

/// What a frame tells of those before it. Once the filter is sure of its path, the frames just
/// before have matches, too, if they were likelier than not to be revisits by then, and a loop
/// whose place turns out to have a twin has none: a backward pass of the PlaceFilter's model over
/// the last few steps gives each of their frames the probability that all frames until now give it.
///
/// Cost and memory have fixed bounds; see kWindowSteps and kMaxFrames in late_loops.cpp.
class LateLoops {
 private:
  struct Step;

 public:
  /// A loop that a later frame found or withdrew.
  struct Loop {
    PlaceId frame = 0;
    PlaceId match = 0;
    std::ptrdiff_t matched_step = 0;
    double similarity = 0;
    double probability = 0;  ///< that the frame is there
  };

  struct Found {
    std::vector<Loop> late;
    std::vector<Loop> withdrawn;
  };

  /// What `now`, the update of a new frame, tells of the frames before: loops that were none before
  /// and have at least `min_probability`, and loops that are more likely wrong than right. Each
  /// frame has at most one late loop and one withdrawn one. `is_step`: as in PlaceFilter::predict.
  [[nodiscard]] Found find(const PlaceFilter::Update& now, bool is_step, double min_probability,
                           const KnownLoops& loops) const;

  /// What commit() adds: a step with the new frame.
  using Next = std::list<Step>;

  /// Takes the memory that commit() needs. `is_loop`: `frame` is one, with the match of `now`.
  [[nodiscard]] static Next prepare(const PlaceFilter::Update& now, PlaceId frame, bool is_loop,
                                    const KnownLoops& loops);

  /// Makes `next` the latest frame, after find() found `found` for it.
  void commit(Next next, bool is_step, const Found& found) noexcept;

  /// Forgets a place, as a frame and as a match.
  void remove(PlaceId place);

  /// Frames that show the same view as `frame` have no match near `matched_step`.
  void reject(PlaceId frame, std::ptrdiff_t matched_step, const KnownLoops& loops);

 private:
  /// A frame of the last few steps.
  struct Frame {
    PlaceId place = 0;
    std::vector<PlaceFilter::Observed> observed;
    std::optional<Loop> loop;    ///< reported and not withdrawn
    bool was_late = false;       ///< has had a late loop
    bool was_withdrawn = false;  ///< has had a loop withdrawn
    bool by_itself = false;      ///< its loop needed no path, which cannot withdraw it
  };

  /// A change of view, with the frames that show it.
  struct Step {
    Belief prior;
    Belief belief;
    Returns returns;
    std::list<Frame> frames;
  };

  static void judge(const Frame& frame, const Step& step, const Belief& belief,
                    double min_probability, const KnownLoops& loops, Found& found);
  void forget_oldest();

  std::list<Step> steps_;
};

}  // namespace loopbit
