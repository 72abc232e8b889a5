// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_detector.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/kernels.hpp"

#include "evidence.hpp"
#include "known_loops.hpp"
#include "place_filter.hpp"
#include "place_memory.hpp"
#include "recent_view.hpp"
#include "still_features.hpp"

namespace loopbit {
namespace {

/// Two frames this alike show the same view: the camera has hardly moved in between.
constexpr double kUnmovedSimilarity = 0.8;

class Stopwatch {
 public:
  double lap_ms() {
    const auto now = Clock::now();
    const std::chrono::duration<double, std::milli> lap = now - std::exchange(start_, now);
    return lap.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// Places of one path that lie no farther apart are one place.
constexpr std::ptrdiff_t kSamePlaceSteps = 6;
/// Of a path that is followed, so many places are looked at, and none that is less likely.
constexpr std::size_t kMaxExpected = 12;
constexpr double kMinExpected = 1e-3;

Status reason_of_rejection(const LookedAt& best, const VerificationOptions& options) {
  const std::size_t matches = best.verification ? best.verification->matches.size() : 0;
  if (matches < static_cast<std::size_t>(options.min_matches)) return Status::few_matches;
  return best.excess() == 0 ? Status::no_geometry : Status::low_score;
}

/// Leaves the matches that moved between two images. Those that did not may be the robot itself,
/// dirt on the lens or its rim, which are in view for ever.
void keep_moved(const Features& query, const Features& place, std::vector<Match>& matches) {
  constexpr float kMinMotion_px = 2.0F;
  std::erase_if(matches, [&](const Match& match) {
    const Keypoint& a = query.keypoints[static_cast<std::size_t>(match.query)];
    const Keypoint& b = place.keypoints[static_cast<std::size_t>(match.place)];
    return std::hypot(b.x_px - a.x_px, b.y_px - a.y_px) <= kMinMotion_px;
  });
}

/// similarity(a, b) by the kernels: a map may have a million places to compare.
double quick_similarity(const BinaryContent& a, const BinaryContent& b) {
  const auto overlap = [](const BinaryContent& x, const BinaryContent& y) {
    std::uint16_t pixels = 0;
    active_kernels().max_overlaps(x.rows.data(), 1, y.rows.data(), 1, &pixels);
    return pixels;
  };
  const int larger = std::max(overlap(a, a), overlap(b, b));
  return larger == 0 ? 0.0 : static_cast<double>(overlap(a, b)) / larger;
}

/// Whether a content shows another view than the latest change of view did, from their similarity.
/// One without pixels, of a dark or covered camera, says nothing of the view.
bool changes_view(const BinaryContent& content, double similarity) {
  return similarity < kUnmovedSimilarity && count(content) > 0;
}

/// Of a keypoint in its image, 0 to 1.
cv::Point2f relative_position(const Features& features, int index) {
  const Keypoint& keypoint = features.keypoints[static_cast<std::size_t>(index)];
  return {keypoint.x_px / static_cast<float>(features.working_size_px.width),
          keypoint.y_px / static_cast<float>(features.working_size_px.height)};
}

}  // namespace

class LoopDetector::Impl {
 public:
  Impl(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map)
      : options_(options),
        memory_(std::move(map)),
        surf_(options.surf),
        verifier_(options.verification) {
    validate(options);
    memory_.check_options(options);
    PlaceId latest_step = 0;
    memory_.restore([&](const BinaryContent& content) {
      const PlaceId place = index_.add(content);
      const bool is_step =
          place == 0 ||
          changes_view(content, quick_similarity(content, index_.content(latest_step)));
      if (is_step) latest_step = place;
      return is_step;
    });
    memory_.restore_loops([&](std::ptrdiff_t step, std::ptrdiff_t earlier_step) {
      known_loops_.add(step, earlier_step);
    });
    null_.reserve_next(static_cast<std::size_t>(index_.size()));
    null_.set_size(static_cast<std::size_t>(index_.size()));
  }

  /// One frame as the detector sees it: all that remember() needs.
  struct Observation {
    cv::Mat1f saliency;
    BinaryContent content;
    Features features;
    RecentView::Look look;
    double similarity_to_latest = 0;  ///< xi of it and the latest change of view
    StillFeatures still;
    std::vector<LookedAt> places;
    NullModel::Lesson lesson;
    std::vector<StepEvidence> evidence;
    Beliefs expected;   ///< where the camera is by the frames before
    Beliefs prior;      ///< the same, where it may have entered an earlier path just now
    Beliefs posterior;  ///< and after
    std::optional<std::size_t> best;  ///< of `places`
    double probability = 0;           ///< that the best is right
  };

  /// The algorithm of Wang et al. 2019, section III.
  Detection detect(const cv::Mat& image, std::optional<double> timestamp_s,
                   Observation& seen) const {
    check_time(timestamp_s);
    memory_.release();
    Detection detection{.frame = size(), .timestamp_s = timestamp_s};
    Stopwatch stopwatch;

    // Step 1: what the image is recognised by.
    const cv::Mat1b gray = gray_image(image);
    seen.saliency = saliency_map(gray, options_.binary_content);
    seen.content = binarize(seen.saliency, options_.binary_content.gamma);
    detection.times.content_ms = stopwatch.lap_ms();

    // Step 3 begins: features. They also tell how far back the present view reaches.
    surf_.extract(gray, seen.features);
    detection.times.features_ms = stopwatch.lap_ms();
    seen.look = look(seen);
    const PlaceId end = first_recent_place(seen.look, timestamp_s);
    find_still(seen);
    seen.expected = expected(seen.look.is_step, end);
    seen.prior = seen.expected;
    detection.times.verification_ms = stopwatch.lap_ms();

    // Step 2: the earlier places that look alike, and those where the robot is expected.
    auto candidates = index_.query(seen.content, end, options_.retrieval);
    const std::size_t listed = candidates.size();
    add_expected(seen, candidates);
    detection.times.retrieval_ms = stopwatch.lap_ms();

    // Step 3: what each shows, against what wrong places show, and where the camera is by that.
    look_at(seen, candidates, listed);
    if (options_.decision.count_matches) {
      count_matches(seen, detection);
    } else {
      weigh(seen, end);
      decide(seen, detection);
    }
    if (seen.places.empty()) {
      detection.status = end == 0 ? Status::no_earlier_place : Status::no_similar_place;
    }
    detection.times.verification_ms += stopwatch.lap_ms();
    return detection;
  }

  [[nodiscard]] Evidence evidence(const Observation& seen, const Detection& detection) const {
    Evidence evidence{seen.content, seen.saliency, {}};
    if (detection.inliers == 0) return evidence;
    const Features& place = features(seen.places[*seen.best].candidate.place);
    const Verification result = verify(seen.features, place, options_.verification);
    evidence.inliers.reserve(result.inliers.size());
    for (const Match& match : result.inliers) {
      evidence.inliers.push_back(
          {relative_position(seen.features, match.query), relative_position(place, match.place)});
    }
    return evidence;
  }

  /// How each place that was looked at scored: the answer, and then the others.
  [[nodiscard]] std::vector<RankedPlace> ranked(Observation& seen,
                                                const Detection& detection) const {
    std::vector<RankedPlace> ranking;
    ranking.reserve(seen.places.size());
    for (std::size_t i = 0; i < seen.places.size(); ++i) {
      LookedAt& place = seen.places[i];
      if (!place.verification) look_closer(seen, place);
      const double score = i == seen.best ? detection.score
                           : options_.decision.count_matches
                               ? static_cast<double>(place.verification->matches.size())
                               : log_odds(seen.posterior.at(place.step));
      ranking.push_back({.place = origin(place.candidate.place),
                         .score = score,
                         .similarity = place.candidate.similarity,
                         .matches = static_cast<int>(place.verification->matches.size()),
                         .inliers = static_cast<int>(place.verification->inliers.size())});
    }
    if (seen.best) {
      const auto best = ranking.begin() + static_cast<std::ptrdiff_t>(*seen.best);
      std::rotate(ranking.begin(), best, best + 1);
      std::stable_sort(ranking.begin() + 1, ranking.end(),
                       [](const auto& a, const auto& b) { return a.score > b.score; });
    }
    return ranking;
  }

  /// All of it or, where it throws, nothing: what needs memory comes first.
  void remember(Observation seen, const Detection& detection, const cv::Mat& image) {
    recent_view_.reserve_next();
    null_.reserve_next(static_cast<std::size_t>(index_.size()));
    KnownLoops found;
    if (detection.status == Status::loop) {
      const std::ptrdiff_t latest = recent_view_.step_of(index_.size());
      found.add(seen.look.is_step ? latest + 1 : latest,
                known_loops_.first_visit(seen.places[*seen.best].step));
    }
    // Correlated as far as it shows what the frame before showed.
    Beliefs beliefs = updated(seen.prior, seen.evidence, 1 - seen.similarity_to_latest);
    std::vector<char> with_best(seen.places.size());
    for (std::size_t i = 0; i < seen.places.size(); ++i) {
      with_best[i] = seen.best && is_same_place(seen.places[i].step, seen.places[*seen.best].step);
    }
    const PlaceId place = add_place(seen.content, std::move(seen.features), detection, image);
    recent_view_.remember(place, seen.look);
    known_loops_.take(found);
    if (!seen.look.is_step) return;
    beliefs_ = std::move(beliefs);
    expected_ = std::move(seen.expected);
    still_ = std::move(seen.still);
    if (seen.evidence.empty()) return;
    null_.learn(seen.lesson, seen.places, [&](const LookedAt& looked_at) {
      const bool is_best =
          with_best[static_cast<std::size_t>(&looked_at - seen.places.data())] != 0;
      return is_best ? 1 - seen.probability : 1.0;
    });
  }

  /// Never throws for its time, so that one bad frame cannot end a drive.
  Detection skip(std::optional<double> timestamp_s) {
    const Detection detection{
        .frame = size(), .timestamp_s = timestamp_s, .status = Status::unreadable};
    add_place(BinaryContent{}, Features{}, detection, cv::Mat());
    return detection;
  }

  /// Frames of this session.
  [[nodiscard]] PlaceId size() const { return index_.size() - memory_.session_begin(); }
  [[nodiscard]] const LoopDetectorOptions& options() const { return options_; }

 private:
  [[nodiscard]] const Features& features(PlaceId place) const { return memory_.features(place); }

  /// See RankedPlace::place.
  [[nodiscard]] SessionFrame origin(PlaceId place) const {
    const PlaceId begin = memory_.session_begin();
    return place < begin ? memory_.origin(place) : SessionFrame{0, place - begin};
  }

  /// See LookedAt::step.
  [[nodiscard]] std::ptrdiff_t step_of(PlaceId place) const {
    return place < memory_.session_begin() ? memory_.step_of(place) : recent_view_.step_of(place);
  }

  /// How many changes of view the places below `end` have seen.
  [[nodiscard]] std::ptrdiff_t steps_before(PlaceId end) const {
    return memory_.earlier_steps() + (end == 0 ? 0 : recent_view_.step_of(end - 1) + 1);
  }

  void check_time(std::optional<double> timestamp_s) const {
    if (options_.exclusion.seconds <= 0) return;
    if (!timestamp_s || !std::isfinite(*timestamp_s)) {
      throw Error(ErrorKind::input,
                  fmt::format("Frame {} has no usable timestamp, but exclusion.seconds is {}; give "
                              "times, or set exclusion.frames in its place.",
                              size(), options_.exclusion.seconds));
    }
    if (!times_s_.empty() && *timestamp_s < times_s_.back()) {
      throw Error(ErrorKind::input,
                  fmt::format("Frame {} has timestamp {} s, before the last one of {} s; give the "
                              "frames in order of time.",
                              size(), *timestamp_s, times_s_.back()));
    }
  }

  /// All of it or, where it throws, nothing.
  PlaceId add_place(const BinaryContent& content, Features features, const Detection& detection,
                    const cv::Mat& image) {
    index_.reserve_next();
    null_.reserve_next(static_cast<std::size_t>(index_.size()));
    // The time of a frame that nothing matches may be wrong, and would shut out those after it.
    const double last_s =
        times_s_.empty() ? -std::numeric_limits<double>::infinity() : times_s_.back();
    times_s_.push_back(
        detection.status == Status::unreadable ? last_s : detection.timestamp_s.value_or(0.0));
    try {
      memory_.add(detection, content, std::move(features), image);
    } catch (...) {
      times_s_.pop_back();
      throw;
    }
    const PlaceId place = index_.add(content);
    null_.set_size(static_cast<std::size_t>(index_.size()));
    return place;
  }

  /// How far back the view of a new frame reaches.
  [[nodiscard]] RecentView::Look look(Observation& seen) const {
    if (!recent_view_.empty()) {
      seen.similarity_to_latest =
          similarity(seen.content, index_.content(recent_view_.latest_step()));
    }
    const bool is_step =
        recent_view_.empty() || changes_view(seen.content, seen.similarity_to_latest);
    return recent_view_.look(index_.size(), is_step, [&](PlaceId place) {
      if (is_window_fixed()) return true;
      const Features& recent = features(place);
      verifier_.match(seen.features, recent, verification_);
      keep_moved(seen.features, recent, verification_.matches);
      verifier_.find_geometry(seen.features, recent, verification_);
      return static_cast<int>(verification_.inliers.size()) >= options_.exclusion.in_view_inliers;
    });
  }

  void find_still(Observation& seen) const {
    verification_.matches.clear();
    if (!recent_view_.empty()) {
      verifier_.match(seen.features, features(recent_view_.latest_step()), verification_);
    }
    seen.still = StillFeatures(seen.features, still_, verification_.matches, seen.look.is_step);
  }

  /// Where the camera is before the frame is looked at. One at rest shows what the latest change of
  /// view showed, which is no second witness.
  [[nodiscard]] Beliefs expected(bool is_step, PlaceId end) const {
    const std::ptrdiff_t end_step = end > memory_.session_begin() ? step_of(end - 1) + 1 : 0;
    const auto exists = [&](std::ptrdiff_t step) {
      return step >= 0 ? step < end_step : memory_.place_at(step).has_value();
    };
    return is_step ? moved(beliefs_, options_.decision.leave_probability, exists)
                   : only(expected_, exists);
  }

  /// Places that are no rivals: near on the path, in one view, or laps that loops found before
  /// have shown to be one place.
  [[nodiscard]] bool is_same_place(std::ptrdiff_t a, std::ptrdiff_t b) const {
    const auto is_near = [&](std::ptrdiff_t x, std::ptrdiff_t y) {
      return std::abs(x - y) <= kSamePlaceSteps || recent_view_.in_one_view(x, y);
    };
    return is_near(a, b) || is_near(known_loops_.first_visit(a), known_loops_.first_visit(b));
  }

  [[nodiscard]] bool is_window_fixed() const {
    return options_.exclusion.frames > 0 || options_.exclusion.seconds > 0;
  }

  /// The end of the places that may be candidates: the exclusion window begins there.
  [[nodiscard]] PlaceId first_recent_place(const RecentView::Look& look,
                                           std::optional<double> timestamp_s) const {
    const ExclusionOptions& exclusion = options_.exclusion;
    PlaceId first = look.begin;
    if (exclusion.frames > 0) first = index_.size() - exclusion.frames;
    if (exclusion.seconds > 0) {
      const auto recent =
          std::upper_bound(times_s_.begin(), times_s_.end(), *timestamp_s - exclusion.seconds);
      first = memory_.session_begin() + static_cast<PlaceId>(recent - times_s_.begin());
    }
    return std::max(memory_.session_begin(), std::min(first, index_.size() - exclusion.min_frames));
  }

  /// A robot that revisits keeps revisiting, even where a place does not look like itself for a
  /// while: the likeliest places of the paths it may be following are looked at, too.
  void add_expected(const Observation& seen, std::vector<Candidate>& candidates) const {
    std::vector<Belief> likely;
    for (const Belief& belief : seen.prior.steps) {
      if (belief.mass() < kMinExpected) continue;
      const bool is_there =
          std::any_of(candidates.begin(), candidates.end(),
                      [&](const Candidate& c) { return step_of(c.place) == belief.step; });
      if (!is_there) likely.push_back(belief);
    }
    std::stable_sort(likely.begin(), likely.end(),
                     [](const Belief& a, const Belief& b) { return a.mass() > b.mass(); });
    likely.resize(std::min(likely.size(), kMaxExpected));
    for (const Belief& belief : likely) {
      const PlaceId place =
          belief.step >= 0 ? recent_view_.place_at(belief.step) : *memory_.place_at(belief.step);
      const double xi = similarity(seen.content, index_.content(place),
                                   options_.retrieval.shift_tolerance_columns);
      // Nothing is like a frame that could not be read.
      if (xi > 0) candidates.push_back({place, xi});
    }
  }

  /// What the strongest features of each candidate share with the frame.
  void look_at(Observation& seen, const std::vector<Candidate>& candidates,
               std::size_t listed) const {
    FirstLook look;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      LookedAt place;
      place.candidate = candidates[i];
      place.step = step_of(candidates[i].place);
      place.is_listed = i < listed;
      verifier_.match_strongest(seen.features, features(place.candidate.place), look);
      place.shared = look.matches;
      seen.still.remove_from(place.shared);
      seen.places.push_back(std::move(place));
    }
  }

  void look_closer(const Observation& seen, LookedAt& place) const {
    const Features& there = features(place.candidate.place);
    place.verification.emplace();
    verifier_.match(seen.features, there, *place.verification);
    seen.still.remove_from(place.verification->matches);
    if (options_.decision.count_matches) return;
    verifier_.find_geometry(seen.features, there, *place.verification);
  }

  /// The evidence of all places and, of those that it puts first, of their geometry; then Bayes.
  void weigh(Observation& seen, PlaceId end) const {
    seen.posterior = seen.prior;
    if (seen.places.empty()) return;
    seen.lesson = null_.weigh(seen.places);
    const auto update = [&] {
      seen.evidence = step_evidence(seen.places);
      seen.posterior = updated(seen.prior, seen.evidence, 1);
    };
    seen.prior = entered(seen.prior, step_evidence(seen.places), steps_before(end));
    update();
    std::vector<std::size_t> order(seen.places.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return seen.posterior.at(seen.places[a].step) > seen.posterior.at(seen.places[b].step);
    });
    const auto closer =
        std::min(order.size(), static_cast<std::size_t>(options_.verification.max_closer_looks));
    for (std::size_t i = 0; i < closer; ++i) {
      look_closer(seen, seen.places[order[i]]);
      null_.weigh_geometry(seen.places[order[i]]);
    }
    update();
  }

  /// Of each step, the place that shows most.
  static std::vector<StepEvidence> step_evidence(const std::vector<LookedAt>& places) {
    std::vector<StepEvidence> evidence;
    for (const LookedAt& place : places) evidence.push_back({place.step, place.log_ratio()});
    std::stable_sort(evidence.begin(), evidence.end(), [](const auto& a, const auto& b) {
      return std::pair(a.step, -a.log_ratio) < std::pair(b.step, -b.log_ratio);
    });
    const auto last = std::unique(evidence.begin(), evidence.end(),
                                  [](const auto& a, const auto& b) { return a.step == b.step; });
    evidence.erase(last, evidence.end());
    return evidence;
  }

  /// log10 of the odds.
  static double log_odds(double probability) {
    constexpr double kLeast = 1e-300;
    return std::log10(std::max(kLeast, probability)) -
           std::log10(std::max(kLeast, 1 - probability));
  }

  void decide(Observation& seen, Detection& detection) const {
    if (seen.places.empty()) return;
    const auto rank = [&](std::size_t i) {
      return std::pair(seen.posterior.at(seen.places[i].step), seen.places[i].log_ratio());
    };
    std::size_t best = 0;
    for (std::size_t i = 1; i < seen.places.size(); ++i) {
      if (rank(i) > rank(best)) best = i;
    }
    seen.best = best;
    if (!seen.places[best].verification) look_closer(seen, seen.places[best]);
    double same = 0;
    double rivals = 0;
    for (const Belief& belief : seen.posterior.steps) {
      (is_same_place(belief.step, seen.places[best].step) ? same : rivals) += belief.mass();
    }
    constexpr double kLeast = 1e-300;
    const double wrong = rivals + seen.posterior.elsewhere;
    seen.probability = same / (same + wrong);
    detection.score = std::log10(std::max(kLeast, same)) - std::log10(std::max(kLeast, wrong));
    const double known = std::log10(std::max(kLeast, same + rivals)) -
                         std::log10(std::max(kLeast, seen.posterior.elsewhere));
    const double least = options_.decision.min_score;
    detection.status = detection.score >= least ? Status::loop
                       : known >= least
                           ? Status::ambiguous
                           : reason_of_rejection(seen.places[best], options_.verification);
    if (seen.places[best].geometry_log_ratio <= 0) {
      // A loop needs a geometry, whatever the path says: without, the odds are even at best.
      detection.score = std::min(detection.score, 0.0);
      if (detection.score < least && detection.status == Status::loop) {
        detection.status = Status::no_geometry;
      }
    }
    tell_match(seen.places[best], detection);
  }

  /// The paper's own decision: the number of matches alone.
  void count_matches(Observation& seen, Detection& detection) const {
    for (std::size_t i = 0; i < seen.places.size(); ++i) {
      look_closer(seen, seen.places[i]);
      const auto matches = [&](std::size_t k) {
        return std::pair(seen.places[k].verification->matches.size(),
                         seen.places[k].candidate.similarity);
      };
      if (!seen.best || matches(i) > matches(*seen.best)) seen.best = i;
    }
    if (!seen.best) return;
    const LookedAt& best = seen.places[*seen.best];
    detection.score = static_cast<double>(best.verification->matches.size());
    detection.status = detection.score >= options_.decision.min_score ? Status::loop
                       : best.verification->matches.size() <
                               static_cast<std::size_t>(options_.verification.min_matches)
                           ? Status::few_matches
                           : Status::low_score;
    tell_match(best, detection);
  }

  void tell_match(const LookedAt& best, Detection& detection) const {
    if (best.candidate.place < memory_.session_begin()) {
      detection.earlier_match = memory_.origin(best.candidate.place);
    } else {
      detection.match = best.candidate.place - memory_.session_begin();
    }
    detection.similarity = best.candidate.similarity;
    detection.matches = static_cast<int>(best.verification->matches.size());
    detection.inliers = static_cast<int>(best.verification->inliers.size());
  }

  LoopDetectorOptions options_;
  PlaceIndex index_;
  PlaceMemory memory_;
  std::vector<double> times_s_;  ///< of each frame of this session, or of the readable one before
  RecentView recent_view_;
  KnownLoops known_loops_;
  Beliefs beliefs_;   ///< after the latest change of view
  Beliefs expected_;  ///< and before it
  NullModel null_;
  StillFeatures still_;  ///< of the latest change of view
  // Working memory, which makes const functions unfit for threads.
  mutable SurfExtractor surf_;
  mutable Verifier verifier_;
  mutable Verification verification_;  ///< of the query and a recent place
};

LoopDetector::LoopDetector(const LoopDetectorOptions& options) : LoopDetector(options, nullptr) {}
LoopDetector::LoopDetector(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map)
    : impl_(std::make_unique<Impl>(options, std::move(map))) {}
LoopDetector::~LoopDetector() = default;
LoopDetector::LoopDetector(LoopDetector&&) noexcept = default;
LoopDetector& LoopDetector::operator=(LoopDetector&&) noexcept = default;

Detection LoopDetector::process(const cv::Mat& image, std::optional<double> timestamp_s,
                                Evidence* evidence) {
  Impl::Observation seen;
  Detection detection = impl_->detect(image, timestamp_s, seen);
  if (evidence) *evidence = impl_->evidence(seen, detection);
  impl_->remember(std::move(seen), detection, image);
  return detection;
}

Detection LoopDetector::query(const cv::Mat& image, std::optional<double> timestamp_s,
                              std::vector<RankedPlace>* ranking) const {
  Impl::Observation seen;
  Detection detection = impl_->detect(image, timestamp_s, seen);
  if (ranking) *ranking = impl_->ranked(seen, detection);
  return detection;
}

Detection LoopDetector::skip(std::optional<double> timestamp_s) { return impl_->skip(timestamp_s); }

PlaceId LoopDetector::size() const { return impl_->size(); }

const LoopDetectorOptions& LoopDetector::options() const { return impl_->options(); }

}  // namespace loopbit
