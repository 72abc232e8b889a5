// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "late_loops.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace loopbit {
namespace {

/// To be sure of a path in a map of some thousand steps takes some seventeen nats: log(N / 0.01)
/// and log(49). A frame by night adds half a nat or more, so the frames of a path that became sure
/// now are among the latest so many steps.
constexpr std::size_t kWindowSteps = 32;
/// A camera that stands still adds frames without end to a step.
constexpr std::size_t kMaxFrames = 128;
/// Below this a loop is more likely wrong than right, and a place more likely new than seen before.
constexpr double kLikely = 0.5;

double probability_near(const Belief& belief, std::ptrdiff_t step, const KnownLoops& loops) {
  double sum = 0;
  for (const Hypothesis& h : belief.places) {
    if (PlaceFilter::is_near(h.step, step, loops)) sum += h.probability();
  }
  return sum;
}

}  // namespace

/// The answer for `frame` of `step` if `belief` is where the robot was.
void LateLoops::judge(const Frame& frame, const Step& step, const Belief& belief,
                      double min_probability, const KnownLoops& loops, Found& found) {
  if (frame.loop) {
    const double probability = probability_near(belief, frame.loop->matched_step, loops);
    if (frame.by_itself || frame.was_withdrawn || probability >= kLikely) return;
    found.withdrawn.push_back(*frame.loop);
    found.withdrawn.back().probability = PlaceFilter::rounded(probability);
  }
  if (frame.was_late) return;
  const auto middle = belief.peak();
  if (!middle) return;
  const double probability = probability_near(belief, *middle, loops);
  if (probability < min_probability) return;
  const auto match = PlaceFilter::match_near(*middle, frame.observed, belief, loops);
  if (!match) return;
  // A path tells roughly where the robot was. The frame itself must speak for its match.
  const PlaceFilter::Observed& matched = frame.observed[*match];
  if (matched.log_likelihood_ratio() <= 0) return;
  // Any path is likelier than a return from anywhere, which counts 1 / N; so later frames would
  // draw the surroundings of a loop into it. They may only confirm what was likely before them.
  if (step.belief.elsewhere() > kLikely) return;
  found.late.push_back({.frame = frame.place,
                        .match = matched.candidate.place,
                        .matched_step = matched.step,
                        .similarity = matched.candidate.similarity,
                        .probability = PlaceFilter::rounded(probability)});
}

LateLoops::Found LateLoops::find(const PlaceFilter::Update& now, bool is_step,
                                 double min_probability, const KnownLoops& loops) const {
  Found found;
  if (now.revisit < min_probability) return found;
  Belief belief = now.belief;
  const Belief* prior = &now.prior;
  const Returns* returns = &now.returns;
  bool is_earlier = is_step;
  for (auto step = steps_.end(); step != steps_.begin();) {
    --step;
    if (is_earlier) belief = one_step_earlier(step->belief, *prior, *returns, belief);
    for (const Frame& frame : step->frames) {
      judge(frame, *step, belief, min_probability, loops, found);
    }
    prior = is_earlier ? &step->prior : prior;
    returns = is_earlier ? &step->returns : returns;
    is_earlier = true;
  }
  const auto by_frame = [](const Loop& a, const Loop& b) { return a.frame < b.frame; };
  std::ranges::sort(found.late, by_frame);
  std::ranges::sort(found.withdrawn, by_frame);
  return found;
}

LateLoops::Next LateLoops::prepare(const PlaceFilter::Update& now, PlaceId frame, bool is_loop,
                                   const KnownLoops& loops) {
  Next next;
  next.push_back({now.prior, now.belief, now.returns, {}});
  Frame& added = next.front().frames.emplace_back();
  added.place = frame;
  added.observed = now.observed;
  if (!is_loop) return next;
  const PlaceFilter::Observed& match = now.observed[*now.match];
  added.loop = Loop{.frame = frame,
                    .match = match.candidate.place,
                    .matched_step = match.step,
                    .similarity = match.candidate.similarity,
                    .probability = now.probability};
  added.by_itself = probability_near(now.belief, match.step, loops) < kLikely;
  return next;
}

void LateLoops::commit(Next next, bool is_step, const Found& found) noexcept {
  for (Step& step : steps_) {
    for (Frame& frame : step.frames) {
      const auto of_frame = [&](const Loop& loop) { return loop.frame == frame.place; };
      if (std::ranges::any_of(found.withdrawn, of_frame)) {
        frame.loop.reset();
        frame.was_withdrawn = true;
      }
      if (const auto late = std::ranges::find_if(found.late, of_frame); late != found.late.end()) {
        frame.loop = *late;
        frame.was_late = true;
      }
    }
  }
  if (is_step || steps_.empty()) {
    steps_.splice(steps_.end(), next);
  } else {
    // It stands for the step, as in the filter.
    Step& latest = steps_.back();
    latest.prior = std::move(next.front().prior);
    latest.belief = std::move(next.front().belief);
    latest.returns = std::move(next.front().returns);
    latest.frames.splice(latest.frames.end(), next.front().frames);
  }
  forget_oldest();
}

void LateLoops::forget_oldest() {
  if (steps_.size() > kWindowSteps) steps_.pop_front();
  std::size_t frames = 0;
  for (const Step& step : steps_) frames += step.frames.size();
  if (frames <= kMaxFrames) return;
  const auto oldest = std::ranges::find_if(steps_, [](const Step& s) { return !s.frames.empty(); });
  oldest->frames.pop_front();
}

void LateLoops::remove(PlaceId place) {
  for (Step& step : steps_) {
    step.frames.remove_if([&](const Frame& frame) { return frame.place == place; });
    for (Frame& frame : step.frames) {
      std::erase_if(frame.observed, [&](const auto& o) { return o.candidate.place == place; });
      if (frame.loop && frame.loop->match == place) frame.loop.reset();
    }
  }
}

void LateLoops::reject(PlaceId frame, std::ptrdiff_t matched_step, const KnownLoops& loops) {
  const auto is_there = [&](std::ptrdiff_t step) {
    return PlaceFilter::is_near(step, matched_step, loops);
  };
  for (Step& step : steps_) {
    if (std::ranges::find(step.frames, frame, &Frame::place) == step.frames.end()) continue;
    for (Frame& shown : step.frames) {
      std::erase_if(shown.observed, [&](const auto& o) { return is_there(o.step); });
      if (shown.loop && is_there(shown.loop->matched_step)) shown.loop.reset();
    }
  }
}

}  // namespace loopbit
