// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_detector.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"

#include "agreement.hpp"
#include "attached_parts.hpp"
#include "candidate_filter.hpp"
#include "known_loops.hpp"
#include "place_memory.hpp"
#include "recent_view.hpp"
#include "voted_paths.hpp"
#include "workspace.hpp"

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

Status reason_of_rejection(const VerifiedCandidate& best, const VerificationOptions& options) {
  if (best.matches < options.min_matches) return Status::few_matches;
  return best.evidence() == 0 ? Status::no_geometry : Status::low_score;
}

/// Inliers that moved between two images. Those that did not may be the robot itself, dirt on the
/// lens or its rim, which are in view for ever.
int moved_inliers(const Features& query, const Features& place, const std::vector<Match>& inliers) {
  constexpr float kMinMotion_px = 2.0F;
  return static_cast<int>(std::count_if(inliers.begin(), inliers.end(), [&](const Match& match) {
    const Keypoint& a = query.keypoints[static_cast<std::size_t>(match.query)];
    const Keypoint& b = place.keypoints[static_cast<std::size_t>(match.place)];
    return std::hypot(b.x_px - a.x_px, b.y_px - a.y_px) > kMinMotion_px;
  }));
}

/// similarity(a, b) by max_overlaps(): a map may have a million places to compare.
double quick_similarity(const BinaryContent& a, const BinaryContent& b) {
  const auto overlap = [](const BinaryContent& x, const BinaryContent& y) {
    std::uint16_t pixels = 0;
    max_overlaps(std::span(&x, 1), std::span(&y, 1), std::span(&pixels, 1));
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
        filter_({[this](PlaceId place) { return origin(place); },
                 [this](const SessionFrame& at) { return find(at); },
                 [this](PlaceId place) { return spot_of(place); }}),
        agreement_(options.decision),
        workspaces_([this] { return make_workspace(); }) {
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
  }

  /// One frame as the detector sees it: all that remember() needs.
  struct Observation {
    cv::Mat1f saliency;
    BinaryContent content;
    std::vector<Keypoint> all_keypoints;  ///< with those of what moves with the camera
    Features features;
    RecentView::Look look;
    PlaceTest is_allowed;  ///< as a candidate; empty = all places are
    FrameContext context;
    PlaceId compared = -1;  ///< the recent place that `work` compares it with
    std::vector<VerifiedCandidate> verified;
    std::optional<VerifiedCandidate> best;  ///< of them and their neighbours
    VotedPaths::Scores scores;
    std::vector<VotedPaths::Path> paths;
    Workspaces::Lease work;
  };

  [[nodiscard]] Observation observation() const {
    Observation seen;
    seen.work = workspaces_.take();
    return seen;
  }

  /// The algorithm of Wang et al. 2019, section III.
  Detection detect(const cv::Mat& image, std::optional<double> timestamp_s,
                   const AllowedPlaces& allowed, Observation& seen) const {
    check_time(timestamp_s);
    Detection detection{.frame = size(), .timestamp_s = timestamp_s};
    Stopwatch stopwatch;

    // Step 1: what the image is recognised by.
    const cv::Mat1b gray = gray_image(image);
    seen.saliency = saliency_map(gray, options_.binary_content);
    seen.content = binarize(seen.saliency, options_.binary_content.gamma);
    detection.times.content_ms = stopwatch.lap_ms();

    // Step 3 begins: features. They also tell how far back the present view reaches.
    seen.work->surf.extract(gray, seen.features);
    remove_attached_parts(seen);
    detection.times.features_ms = stopwatch.lap_ms();
    recognise(seen, allowed, detection);
    return detection;
  }

  /// The same for an observation whose content and features are known.
  Detection detect(std::optional<double> timestamp_s, Observation& seen) const {
    check_time(timestamp_s);
    Detection detection{.frame = size(), .timestamp_s = timestamp_s};
    recognise(seen, {}, detection);
    return detection;
  }

  /// Its second half: finds the place that `seen` shows by its content and features.
  void recognise(Observation& seen, const AllowedPlaces& allowed, Detection& detection) const {
    Stopwatch stopwatch;
    seen.look = look(seen);
    const PlaceId end = first_recent_place(seen.look, detection.timestamp_s);
    seen.is_allowed = filter_.test(allowed, seen.look.is_step);
    seen.context = {steps_before(end), view_inliers(seen)};
    detection.times.verification_ms = stopwatch.lap_ms();

    // Step 2: the earlier places that look alike, and those where the robot is expected.
    auto candidates = index_.query(seen.content, end, options_.retrieval, nullptr, seen.is_allowed);
    const std::size_t num_similar = candidates.size();
    add_expected(seen, end, candidates);
    detection.times.retrieval_ms = stopwatch.lap_ms();

    // Step 3: the one that geometry and the frames before agree on.
    seen.verified = seen.work->candidates.verify(verified_query(seen), candidates);
    decide(seen, end, detection);
    follow_paths(seen, candidates, num_similar, end);
    decide_by_path(seen, detection);
    detection.times.verification_ms += stopwatch.lap_ms();
  }

  [[nodiscard]] Evidence evidence(const Observation& seen, const Detection& detection) const {
    Evidence evidence{seen.content, seen.saliency, {}};
    if (detection.inliers == 0) return evidence;
    const Features& place = features(seen.best->candidate.place, seen);
    const Verification result = verify(seen.features, place, options_.verification);
    evidence.inliers.reserve(result.inliers.size());
    for (const Match& match : result.inliers) {
      evidence.inliers.push_back(
          {relative_position(seen.features, match.query), relative_position(place, match.place)});
    }
    return evidence;
  }

  /// How each candidate scored: the answer, and then the others in the order of their rank.
  [[nodiscard]] std::vector<RankedPlace> ranked(Observation& seen,
                                                const Detection& detection) const {
    seen.work->candidates.complete(verified_query(seen), seen.verified);
    if (seen.best) {
      std::erase_if(seen.verified, [&](const VerifiedCandidate& v) {
        return v.candidate.place == seen.best->candidate.place;
      });
    }
    std::stable_sort(seen.verified.begin(), seen.verified.end(),
                     [&](const auto& a, const auto& b) { return rank(a, seen) > rank(b, seen); });
    // First, whatever those that were left out turn out to have.
    if (seen.best) seen.verified.insert(seen.verified.begin(), *seen.best);
    std::vector<RankedPlace> places;
    places.reserve(seen.verified.size());
    for (const VerifiedCandidate& v : seen.verified) {
      places.push_back({.place = origin(v.candidate.place),
                        .score = agreement_.score(v, seen.look.is_step),
                        .similarity = v.candidate.similarity,
                        .matches = v.matches,
                        .inliers = v.inliers});
    }
    if (seen.best) places.front().score = detection.score;
    return places;
  }

  /// All of it or, where it throws, nothing: what needs memory comes first.
  void remember(Observation seen, const Detection& detection, const cv::Mat& image) {
    recent_view_.reserve_next();
    attached_parts_.reserve_next(seen.features.working_size_px);
    KnownLoops found;
    if (detection.status == Status::loop) {
      const std::ptrdiff_t latest = recent_view_.step_of(index_.size());
      found.add(seen.look.is_step ? latest + 1 : latest, seen.best->step);
    }
    Agreement agreement = agreement_;
    if (seen.look.is_step) {
      if (seen.best) seen.verified.push_back(*seen.best);
      agreement.remember(seen.verified);
    }
    VotedPaths voted_paths = voted_paths_;
    voted_paths.remember(std::move(seen.scores), seen.paths, seen.look.is_step);
    const cv::Size working_size_px = seen.features.working_size_px;
    const PlaceId place = add_place(seen.content, std::move(seen.features), detection, image);
    recent_view_.remember(place, seen.look);
    if (seen.look.is_step) filter_.note_change_of_view();
    memory_.leave_behind([&](PlaceId removed) { return recent_view_.is_in_view(removed); });
    attached_parts_.remember(working_size_px, seen.all_keypoints);
    latest_view_inliers_ = seen.context.view_inliers;
    known_loops_.take(found);
    agreement_ = std::move(agreement);
    voted_paths_ = std::move(voted_paths);
  }

  /// Never throws for its time, so that one bad frame cannot end a drive.
  Detection skip(std::optional<double> timestamp_s) {
    Detection detection{.frame = size(), .timestamp_s = timestamp_s, .status = Status::unreadable};
    add_place(BinaryContent{}, Features{}, detection, cv::Mat());
    return detection;
  }

  /// See LoopDetector::remove.
  void remove(const SessionFrame& at) {
    const auto place = find(at);
    if (!place) throw missing(at);
    if (filter_.is_removed(*place)) return;
    memory_.remove(*place, recent_view_.is_in_view(*place));
    filter_.remove(*place);
  }

  /// See LoopDetector::reject. The map may have loops of places that are gone.
  void reject(const SessionFrame& query, const SessionFrame& match) {
    const auto place = find(query);
    const auto wrong = find(match);
    if (!place && query.session == 0) throw missing(query);
    if (!wrong && match.session == 0) throw missing(match);
    memory_.reject(query, match);
    if (!place || !wrong) return;
    known_loops_.remove(step_of(*place), step_of(*wrong));
    if (*place < memory_.session_begin()) return;
    const std::ptrdiff_t steps_ago = step_of(index_.size() - 1) - step_of(*place);
    agreement_.withdraw(step_of(*wrong), steps_ago);
    voted_paths_ = {};
    if (steps_ago == 0) filter_.reject(*wrong);
  }

  /// Frames of this session.
  [[nodiscard]] PlaceId size() const { return index_.size() - memory_.session_begin(); }
  [[nodiscard]] const LoopDetectorOptions& options() const { return options_; }

 private:
  [[nodiscard]] std::unique_ptr<Workspace> make_workspace() const {
    return std::make_unique<Workspace>(
        options_, memory_, [this](PlaceId place) { return step_of(place); }, agreement_,
        known_loops_);
  }

  [[nodiscard]] const Features& features(PlaceId place, const Observation& seen) const {
    return memory_.features(place, seen.work->held);
  }

  /// See RankedPlace::place.
  [[nodiscard]] SessionFrame origin(PlaceId place) const {
    const PlaceId begin = memory_.session_begin();
    return place < begin ? memory_.origin(place) : SessionFrame{0, place - begin};
  }

  /// The reverse of origin(); none if there is no such place.
  [[nodiscard]] std::optional<PlaceId> find(const SessionFrame& at) const {
    if (at.session != 0) return memory_.find(at);
    if (at.frame < 0 || at.frame >= size()) return std::nullopt;
    return memory_.session_begin() + at.frame;
  }

  [[nodiscard]] Error missing(const SessionFrame& at) const {
    if (at.session == 0) {
      return {ErrorKind::option,
              fmt::format("There is no frame {}: this session has {} so far.", at.frame, size())};
    }
    return {ErrorKind::option,
            fmt::format("There is no place of session {}, frame {}: it was removed or unreadable, "
                        "or no map has it; session 0 is this session.",
                        at.session, at.frame)};
  }

  [[nodiscard]] Spot spot_of(PlaceId place) const {
    return {step_of(place), known_loops_.first_visit(step_of(place))};
  }

  /// See VerifiedCandidate::step.
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
    return index_.add(content);
  }

  static CandidateVerifier::Query verified_query(const Observation& seen) {
    return {seen.features, seen.look.is_step, seen.context};
  }

  /// The paper knows nothing of them.
  void remove_attached_parts(Observation& seen) const {
    if (options_.decision.count_matches) return;
    seen.all_keypoints = seen.features.keypoints;
    attached_parts_.remove_from(seen.content);
    attached_parts_.remove_from(seen.features);
  }

  /// How far back the view of a new frame reaches.
  [[nodiscard]] RecentView::Look look(Observation& seen) const {
    const bool is_step =
        recent_view_.empty() ||
        changes_view(seen.content,
                     similarity(seen.content, index_.content(recent_view_.latest_step())));
    return recent_view_.look(index_.size(), is_step, [&](PlaceId place) {
      if (is_window_fixed()) return true;
      const Verification& shared = compare(seen, place);
      return moved_inliers(seen.features, features(place, seen), shared.inliers) >=
             options_.exclusion.in_view_inliers;
    });
  }

  /// See FrameContext. A frame that shows the same as the last step can recognise as much.
  [[nodiscard]] int view_inliers(Observation& seen) const {
    if (options_.decision.count_matches || recent_view_.empty()) return 0;
    if (!seen.look.is_step) return latest_view_inliers_;
    return compare(seen, recent_view_.latest_step()).distinct_inliers;
  }

  /// What a frame shares with a recent place.
  const Verification& compare(Observation& seen, PlaceId place) const {
    Workspace& work = *seen.work;
    if (seen.compared != place) {
      const Features& recent = features(place, seen);
      work.verifier.match(seen.features, recent, work.verification);
      work.verifier.find_geometry(seen.features, recent, work.verification);
      seen.compared = place;
    }
    return work.verification;
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

  using Rank = std::tuple<bool, double, int, double>;

  /// Which of several candidates is the place. Agreement over time says that the robot is back; of
  /// places that are accepted, the one that shows most itself is where.
  [[nodiscard]] Rank rank(const VerifiedCandidate& v, const Observation& seen) const {
    const double score = agreement_.score(v, seen.look.is_step);
    const bool is_accepted = score >= options_.decision.min_score;
    return {is_accepted, is_accepted ? v.evidence() : score, v.matches, v.candidate.similarity};
  }

  [[nodiscard]] Candidate candidate(PlaceId place, const BinaryContent& content) const {
    return {place,
            similarity(content, index_.content(place), options_.retrieval.shift_tolerance_columns)};
  }

  /// The places below `end` that lie at most `radius` from `middle` and are allowed, in order.
  static std::vector<PlaceId> around(PlaceId middle, int radius, PlaceId end,
                                     const PlaceTest& is_allowed) {
    const PlaceId first = std::max(0, middle - radius);
    const PlaceId last = std::min(end - 1, middle + radius);
    std::vector<PlaceId> places;
    for (PlaceId place = first; place <= last; ++place) {
      if (!is_allowed || is_allowed(place)) places.push_back(place);
    }
    return places;
  }

  /// A robot that revisits keeps revisiting, even where a place does not look like itself for a
  /// while.
  void add_expected(const Observation& seen, PlaceId end,
                    std::vector<Candidate>& candidates) const {
    const int radius = options_.retrieval.min_spacing;
    for (const PlaceId followed : agreement_.followed_places()) {
      for (const PlaceId place : around(followed, radius, end, seen.is_allowed)) {
        const bool is_there =
            std::any_of(candidates.begin(), candidates.end(),
                        [&](const Candidate& other) { return other.place == place; });
        if (is_there) continue;
        const Candidate expected = candidate(place, seen.content);
        // Nothing is like a frame that could not be read.
        if (expected.similarity > 0) candidates.push_back(expected);
      }
    }
  }

  [[nodiscard]] std::vector<Candidate> candidates_around(PlaceId middle, int radius, PlaceId end,
                                                         const Observation& seen) const {
    std::vector<Candidate> candidates;
    for (const PlaceId place : around(middle, radius, end, seen.is_allowed)) {
      candidates.push_back(candidate(place, seen.content));
    }
    return candidates;
  }

  /// The best candidate, refined: candidates stand apart, so a place beside it may be the best.
  [[nodiscard]] VerifiedCandidate refined(const VerifiedCandidate& best, const Observation& seen,
                                          PlaceId end) const {
    const CandidateVerifier::Query query = verified_query(seen);
    const int radius = options_.retrieval.min_spacing;
    const VerifiedCandidate closest = seen.work->candidates.closest(
        query, best, seen.verified, candidates_around(best.candidate.place, radius, end, seen));
    return seen.work->candidates.located(
        query, closest, seen.verified,
        candidates_around(closest.candidate.place, radius + CandidateVerifier::kReach, end, seen));
  }

  [[nodiscard]] Status judged(VerifiedCandidate best, const Observation& seen) const {
    const auto accepted = [&] {
      return agreement_.score(best, seen.look.is_step) >= options_.decision.min_score;
    };
    if (accepted()) return Status::loop;
    best.distinctness = 1;
    return accepted() ? Status::ambiguous : reason_of_rejection(best, options_.verification);
  }

  void decide(Observation& seen, PlaceId end, Detection& detection) const {
    if (seen.verified.empty()) {
      detection.status = end == 0 ? Status::no_earlier_place : Status::no_similar_place;
      return;
    }
    auto best = *std::max_element(
        seen.verified.begin(), seen.verified.end(),
        [&](const auto& a, const auto& b) { return rank(a, seen) < rank(b, seen); });
    // Below, a neighbour is no likelier to be right than any other place.
    const auto score = [&] { return agreement_.score(best, seen.look.is_step); };
    if (score() > options_.decision.chance_evidence) best = refined(best, seen, end);
    detection.score = score();
    detection.status = judged(best, seen);
    report_match(best, seen, detection);
  }

  void report_match(const VerifiedCandidate& best, Observation& seen, Detection& detection) const {
    seen.best = best;
    detection.match.reset();
    detection.earlier_match.reset();
    if (best.candidate.place < memory_.session_begin()) {
      detection.earlier_match = memory_.origin(best.candidate.place);
    } else {
      detection.match = best.candidate.place - memory_.session_begin();
    }
    detection.similarity = best.candidate.similarity;
    detection.matches = best.matches;
    detection.inliers = best.inliers;
  }

  /// Scores the candidates and where the paths so far lead. From farther away more of a view looks
  /// alike than geometry tells, so the recent view counts twice.
  void follow_paths(Observation& seen, const std::vector<Candidate>& candidates,
                    std::size_t num_similar, PlaceId end) const {
    if (options_.decision.min_path_margin == 0) return;
    const PlaceId limit = std::max(memory_.session_begin(), 2 * end - index_.size());
    const CandidateVerifier::Query query = verified_query(seen);
    std::vector<VotedPaths::Votes> votes;
    const auto look = [&](PlaceId place) {
      const bool is_known =
          std::ranges::any_of(votes, [&](const auto& v) { return v.place == place; });
      if (place < 0 || place >= limit || is_known) return;
      if (seen.is_allowed && !seen.is_allowed(place)) return;
      votes.push_back({place, step_of(place), seen.work->candidates.votes(query, place)});
    };
    std::size_t num_null = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      look(candidates[i].place);
      if (i < num_similar) num_null = votes.size();
    }
    for (const PlaceId place : voted_paths_.expected_places()) look(place);
    seen.scores = VotedPaths::scores(votes, num_null);
    seen.paths = voted_paths_.paths(seen.scores, seen.look.is_step);
  }

  /// Where geometry sees no more than chance gives, and so cannot speak for or against a place,
  /// paths decide.
  void decide_by_path(Observation& seen, Detection& detection) const {
    const DecisionOptions& decision = options_.decision;
    const bool is_decided =
        detection.status == Status::loop || detection.status == Status::ambiguous;
    if (is_decided || !seen.best || seen.best->distinct_inliers > decision.chance_evidence) return;
    const auto best = VotedPaths::best(seen.paths, [this](std::ptrdiff_t step) {
      return Spot{step, known_loops_.first_visit(step)};
    });
    if (!best || best->margin_sigmas < decision.min_path_margin) return;
    const PlaceId place = best->path.end.place;
    std::vector<VerifiedCandidate> match{{candidate(place, seen.content), step_of(place)}};
    seen.work->candidates.complete(verified_query(seen), match);
    detection.score = decision.min_score * best->margin_sigmas / decision.min_path_margin;
    detection.status = Status::loop;
    report_match(match.front(), seen, detection);
  }

  LoopDetectorOptions options_;
  PlaceIndex index_;
  PlaceMemory memory_;
  std::vector<double> times_s_;  ///< of each frame of this session, or of the readable one before
  RecentView recent_view_;
  AttachedParts attached_parts_;
  CandidateFilter filter_;
  int latest_view_inliers_ = 0;  ///< see FrameContext
  Agreement agreement_;
  KnownLoops known_loops_;
  VotedPaths voted_paths_;
  mutable Workspaces workspaces_;
};

LoopDetector::LoopDetector(const LoopDetectorOptions& options) : LoopDetector(options, nullptr) {}
LoopDetector::LoopDetector(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map)
    : impl_(std::make_unique<Impl>(options, std::move(map))) {}
LoopDetector::~LoopDetector() = default;
LoopDetector::LoopDetector(LoopDetector&&) noexcept = default;
LoopDetector& LoopDetector::operator=(LoopDetector&&) noexcept = default;

Detection LoopDetector::process(const cv::Mat& image, std::optional<double> timestamp_s,
                                Evidence* evidence, const AllowedPlaces& allowed) {
  Impl::Observation seen = impl_->observation();
  Detection detection = impl_->detect(image, timestamp_s, allowed, seen);
  if (evidence) *evidence = impl_->evidence(seen, detection);
  impl_->remember(std::move(seen), detection, image);
  return detection;
}

Detection LoopDetector::process(const BinaryContent& content, Features features,
                                std::optional<double> timestamp_s) {
  Impl::Observation seen = impl_->observation();
  seen.content = content;
  seen.features = std::move(features);
  Detection detection = impl_->detect(timestamp_s, seen);
  impl_->remember(std::move(seen), detection, cv::Mat());
  return detection;
}

Detection LoopDetector::query(const cv::Mat& image, std::optional<double> timestamp_s,
                              std::vector<RankedPlace>* ranking, Evidence* evidence,
                              const AllowedPlaces& allowed) const {
  Impl::Observation seen = impl_->observation();
  Detection detection = impl_->detect(image, timestamp_s, allowed, seen);
  if (evidence) *evidence = impl_->evidence(seen, detection);
  if (ranking) *ranking = impl_->ranked(seen, detection);
  return detection;
}

Detection LoopDetector::skip(std::optional<double> timestamp_s) { return impl_->skip(timestamp_s); }

void LoopDetector::remove(const SessionFrame& place) { impl_->remove(place); }

void LoopDetector::reject(const SessionFrame& query, const SessionFrame& match) {
  impl_->reject(query, match);
}

void LoopDetector::reject(const Detection& loop) {
  if (!loop.match && !loop.earlier_match) {
    throw Error(ErrorKind::option,
                fmt::format("Frame {} has no match that could be rejected.", loop.frame));
  }
  reject({0, loop.frame}, loop.earlier_match.value_or(SessionFrame{0, loop.match.value_or(0)}));
}

PlaceId LoopDetector::size() const { return impl_->size(); }

const LoopDetectorOptions& LoopDetector::options() const { return impl_->options(); }

}  // namespace loopbit
