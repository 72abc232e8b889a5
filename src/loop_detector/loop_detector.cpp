// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_detector.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"

#include "attached_parts.hpp"
#include "candidate_filter.hpp"
#include "candidate_finder.hpp"
#include "exclusion_window.hpp"
#include "late_loops.hpp"
#include "place_filter.hpp"
#include "places.hpp"
#include "session_odometry.hpp"
#include "workspace.hpp"

namespace loopbit {
namespace {

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

/// A frame is compared with all its keypoints if the robot is at an earlier place with this
/// probability, so that most new places cost little.
constexpr double kWorthACloserLook = 0.1;

LoopDetectorOptions validated(const LoopDetectorOptions& options) {
  validate(options);
  return options;
}

Status reason_of_rejection(const CandidateGeometry& best, const VerificationOptions& options) {
  if (best.matches < options.min_matches) return Status::few_matches;
  return best.inliers.empty() ? Status::no_geometry : Status::low_score;
}

/// Throws Error (kind input) unless they are whole, as SurfExtractor makes them.
void check_whole(const Features& features) {
  const std::size_t size = features.keypoints.size();
  const cv::Size& size_px = features.working_size_px;
  constexpr std::size_t kMost = std::numeric_limits<std::int16_t>::max();
  const bool has_image =
      size_px.width >= 0 && size_px.height >= 0 && (size == 0 || !size_px.empty());
  if (features.descriptors.size() == size && features.num_dark <= size && size <= kMost &&
      has_image) {
    return;
  }
  throw Error(
      ErrorKind::input,
      fmt::format("Features with {} keypoints, {} descriptors and {} dark blobs in {} x {} px "
                  "are not whole; give those that loopbit extracted.",
                  size, features.descriptors.size(), features.num_dark, size_px.width,
                  size_px.height));
}

/// Of a keypoint in its image, 0 to 1.
cv::Point2f relative_position(const Features& features, int index) {
  const Keypoint& keypoint = features.keypoint(index);
  return {keypoint.x_px / static_cast<float>(features.working_size_px.width),
          keypoint.y_px / static_cast<float>(features.working_size_px.height)};
}

}  // namespace

class LoopDetector::Impl {
 public:
  Impl(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map)
      : options_(validated(options)),
        places_(options_, std::move(map)),
        window_(options_, places_),
        odometry_(options_, places_),
        finder_(options_, places_, odometry_),
        filter_(places_),
        workspaces_([this] { return std::make_unique<Workspace>(options_, places_); }) {}

  /// Takes in what other robots added to the map. Call it before a frame.
  void learn() { places_.learn(); }

  /// What comes with an image.
  struct Given {
    std::optional<double> timestamp_s;
    const std::optional<OdometryPose>& odometry;
  };

  /// One frame as the detector sees it: all that remember() needs.
  struct Observation {
    cv::Mat1f saliency;
    BinaryContent content;
    std::vector<Keypoint> all_keypoints;  ///< with those of what moves with the camera
    Features features;
    ExclusionWindow::View view;
    FrameCandidates candidates;
    std::vector<VerifiedCandidate> verified;
    std::optional<VerifiedCandidate> best;  ///< of them
    std::vector<int> votes_just_left;       ///< see PlaceFilter::Steps
    bool closely = false;                   ///< see CandidateVerifier::Query
    PlaceFilter::Update update;
    LateLoops::Found changed;  ///< loops of earlier frames
    Workspaces::Lease work;
  };

  [[nodiscard]] Observation observation() const {
    Observation seen;
    seen.work = workspaces_.take();
    return seen;
  }

  /// See LoopDetector::prepare.
  [[nodiscard]] PreparedImage prepare(const cv::Mat& image) const {
    PreparedImage prepared{.image = image};
    Stopwatch stopwatch;

    // Step 1: what the image is recognised by.
    const cv::Mat1b gray = gray_image(image);
    if (camera_) check_size(*camera_, "The calibration of set_camera()", gray.size());
    prepared.saliency = saliency_map(gray, options_.binary_content);
    prepared.content = binarize(prepared.saliency, options_.binary_content.gamma, excluded_);
    prepared.times.content_ms = stopwatch.lap_ms();

    // Step 3 begins: features. They also tell how far back the present view reaches.
    workspaces_.take()->surf.extract(gray, prepared.features, mask_);
    prepared.times.features_ms = stopwatch.lap_ms();
    return prepared;
  }

  /// The algorithm of Wang et al. 2019, section III.
  Detection detect(PreparedImage prepared, const Given& given, const AllowedPlaces& allowed,
                   Observation& seen) const {
    Detection detection = unanswered(given);
    detection.times = prepared.times;
    Stopwatch stopwatch;
    seen.saliency = std::move(prepared.saliency);
    seen.content = prepared.content;
    seen.features = std::move(prepared.features);
    remove_attached_parts(seen);
    detection.times.features_ms += stopwatch.lap_ms();
    recognise(seen, allowed, detection);
    return detection;
  }

  /// The same for an observation whose content and features are known.
  Detection detect(const Given& given, Observation& seen) const {
    check_whole(seen.features);
    seen.all_keypoints = seen.features.keypoints;  // which tell how many views there were
    Detection detection = unanswered(given);
    recognise(seen, {}, detection);
    return detection;
  }

  /// Its second half: finds the place that `seen` shows by its content and features.
  void recognise(Observation& seen, const AllowedPlaces& allowed, Detection& detection) const {
    Stopwatch stopwatch;
    seen.view =
        window_.view({seen.content, seen.features}, detection.timestamp_s, camera(), *seen.work);
    detection.times.verification_ms = stopwatch.lap_ms();

    // Step 2: the earlier places that look alike, and those where the robot is expected.
    const bool is_step = seen.view.look.is_step;
    Belief prior = place_filter_.predict(is_step, odometry_.agreement_of_moves(detection.odometry));
    seen.candidates = finder_.find({seen.content, seen.view, prior, detection.odometry},
                                   filter_.test(allowed, is_step));
    detection.times.retrieval_ms = stopwatch.lap_ms();

    // Step 3: the one that features, geometry and the frames before agree on.
    seen.closely = 1 - prior.elsewhere() >= kWorthACloserLook;
    CandidateVerifier::Query query = verified_query(seen);
    query.may_match = [&](PlaceId place) { return seen.candidates.may_match(place); };
    seen.verified =
        seen.work->candidates.verify(query, seen.candidates.places, seen.candidates.num_similar);
    for (const VerifiedCandidate& v :
         std::span(seen.verified).last(seen.candidates.num_just_left)) {
      seen.votes_just_left.push_back(v.votes.count);
    }
    seen.verified.resize(seen.verified.size() - seen.candidates.num_just_left);
    const std::size_t num_similar =
        seen.candidates.num_similar - remove_alike_by_attached_parts(seen);
    decide(seen, std::move(prior), num_similar, detection);
    report_unreachable(seen, detection);
    report_earlier_frames(seen, detection);
    detection.times.verification_ms += stopwatch.lap_ms();
  }

  [[nodiscard]] Evidence evidence(const Observation& seen, const Detection& detection) const {
    Evidence evidence{seen.content, seen.saliency, {}};
    if (detection.inliers == 0) return evidence;
    const Features& place = features(seen.best->candidate.place, seen);
    const std::vector<Match>& inliers = seen.best->geometry->inliers;
    evidence.inliers.reserve(inliers.size());
    for (const Match& match : inliers) {
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
                     [&](const auto& a, const auto& b) { return score(a, seen) > score(b, seen); });
    // First, whatever those that were left out turn out to have.
    if (seen.best) seen.verified.insert(seen.verified.begin(), *seen.best);
    std::vector<RankedPlace> places;
    places.reserve(seen.verified.size());
    for (const VerifiedCandidate& v : seen.verified) {
      places.push_back({.place = places_.origin(v.candidate.place),
                        .score = score(v, seen),
                        .similarity = v.candidate.similarity,
                        .matches = v.geometry->matches,
                        .inliers = static_cast<int>(v.geometry->inliers.size())});
    }
    if (seen.best) places.front().score = detection.score;
    return places;
  }

  /// All of it or, where it throws, nothing: what needs memory comes first.
  void remember(Observation seen, const Detection& detection, const cv::Mat& image) {
    attached_parts_.reserve_next(seen.features.working_size_px);
    KnownLoops found;
    std::optional<Shortcuts::Next> shortcuts;
    if (detection.status == Status::loop) {
      const std::ptrdiff_t latest = places_.step_of(places_.size());
      found.add(seen.view.look.is_step ? latest + 1 : latest, seen.best->step);
      if (const auto& reach = seen.candidates.reach) {
        shortcuts = odometry_.shortcuts_with(detection, *reach);
      }
    }
    LateLoops::Next frame;
    if (!options_.decision.count_matches) {
      frame = LateLoops::prepare(seen.update, places_.size(), detection.status == Status::loop,
                                 places_.known_loops());
    }
    PlaceFilter::Next next = place_filter_.prepare(std::move(seen.update), seen.view.look.is_step,
                                                   places_.known_loops());
    const cv::Size working_size_px = seen.features.working_size_px;
    add_place(seen.content, std::move(seen.features), seen.view, detection, image);
    if (seen.view.look.is_step) filter_.note_change_of_view();
    attached_parts_.remember(working_size_px, seen.all_keypoints);
    places_.known_loops().take(found);
    if (shortcuts) odometry_.commit(std::move(*shortcuts));
    place_filter_.commit(std::move(next));
    if (options_.decision.count_matches) return;
    late_loops_.commit(std::move(frame), seen.view.look.is_step, seen.changed);
    for (const LateLoops::Loop& loop : seen.changed.withdrawn) {
      places_.known_loops().remove(places_.step_of(loop.frame), loop.matched_step);
      odometry_.remove_shortcut(loop.frame - places_.session_begin());
    }
  }

  /// Never throws for its time, so that one bad frame cannot end a drive.
  Detection skip(const Given& given) {
    check(given.odometry);
    Detection detection{.frame = size(),
                        .timestamp_s = given.timestamp_s,
                        .status = Status::unreadable,
                        .odometry = given.odometry,
                        .epoch = places_.epoch()};
    add_place(BinaryContent{}, Features{}, std::nullopt, detection, cv::Mat());
    return detection;
  }

  /// See LoopDetector::set_mask.
  void set_mask(const cv::Mat& mask) {
    if (mask.empty()) {
      mask_ = cv::Mat1b();
      excluded_ = {};
      return;
    }
    if (mask.type() != CV_8UC1) {
      throw Error(ErrorKind::option,
                  fmt::format("The mask is of OpenCV type {}; give one of 8 bits, grey.",
                              cv::typeToString(mask.type())));
    }
    const cv::Mat1b copy = mask.clone();
    const BinaryContent excluded = excluded_pixels(copy);
    if (count(excluded) == kContentSide * kContentSide) {
      throw Error(
          ErrorKind::option,
          fmt::format(
              "The mask excludes the whole image. Pixels that count must not be 0; that is so "
              "for {} of its {} pixels.",
              cv::countNonZero(copy), copy.total()));
    }
    excluded_ = excluded;
    mask_ = copy;
  }

  /// See LoopDetector::set_camera.
  void set_camera(const std::optional<CameraModel>& camera) {
    if (camera) validate(*camera, "The calibration of set_camera()");
    if (camera && camera->size_px.empty()) {
      throw Error(ErrorKind::input,
                  "The calibration of set_camera() does not say how large its images are; give one "
                  "with its size_px.");
    }
    camera_ = camera;
  }

  /// See LoopDetector::remove.
  void remove(const SessionFrame& at) {
    const auto place = places_.find(at);
    if (!place) throw missing(at);
    if (filter_.is_removed(*place)) return;
    places_.remove(*place);
    filter_.remove(*place);
    late_loops_.remove(*place);
  }

  /// See LoopDetector::reject. The map may have loops of places that are gone.
  void reject(const SessionFrame& query, const SessionFrame& match) {
    const auto place = places_.find(query);
    const auto wrong = places_.find(match);
    if (!place && query.session == 0) throw missing(query);
    if (!wrong && match.session == 0) throw missing(match);
    places_.reject(query, match);
    if (!place || !wrong) return;
    const std::ptrdiff_t step = places_.step_of(*place);
    const std::ptrdiff_t wrong_step = places_.step_of(*wrong);
    places_.known_loops().remove(step, wrong_step);
    if (*place < places_.session_begin()) return;
    odometry_.remove_shortcut(query.frame);
    place_filter_.withdraw(wrong_step, places_.known_loops());
    late_loops_.reject(*place, wrong_step, places_.known_loops());
    if (places_.step_of(places_.size() - 1) == step) filter_.reject(*wrong);
  }

  /// See LoopDetector::features_of.
  [[nodiscard]] Features features_of(const SessionFrame& at) const {
    const auto place = places_.find(at);
    if (!place) throw missing(at);
    if (filter_.is_removed(*place)) return {};
    PlaceMemory::Held held;
    return places_.features(*place, held);
  }

  /// Frames of this session.
  [[nodiscard]] PlaceId size() const { return places_.size() - places_.session_begin(); }
  [[nodiscard]] const LoopDetectorOptions& options() const { return options_; }

 private:
  [[nodiscard]] const Features& features(PlaceId place, const Observation& seen) const {
    return places_.features(place, seen.work->held);
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

  /// The answer before there is any. Throws Error (kind input) for what cannot be used.
  [[nodiscard]] Detection unanswered(const Given& given) const {
    window_.check_time(given.timestamp_s);
    check(given.odometry);
    return {.frame = size(),
            .timestamp_s = given.timestamp_s,
            .odometry = given.odometry,
            .epoch = places_.epoch()};
  }

  void check(const std::optional<OdometryPose>& odometry) const {
    if (odometry) check_odometry(*odometry, fmt::format("The odometry of frame {}", size()));
  }

  /// All of it or, where it throws, nothing.
  void add_place(const BinaryContent& content, Features features,
                 const std::optional<ExclusionWindow::View>& view, const Detection& detection,
                 const cv::Mat& image) {
    odometry_.reserve_next(detection.odometry.has_value());
    window_.reserve_next();
    places_.add(content, std::move(features), view ? std::optional(view->look) : std::nullopt,
                detection, image);
    window_.add(detection, view);
    odometry_.add(detection.odometry);
  }

  [[nodiscard]] CandidateVerifier::Query verified_query(const Observation& seen) const {
    return {seen.features, seen.view.shared, seen.closely, camera()};
  }

  /// Null = not known.
  [[nodiscard]] const CameraModel* camera() const { return camera_ ? &*camera_ : nullptr; }

  /// The paper knows nothing of them.
  void remove_attached_parts(Observation& seen) const {
    if (options_.decision.count_matches) return;
    seen.all_keypoints = seen.features.keypoints;
    attached_parts_.remove_from(seen.content);
    attached_parts_.remove_from(seen.features);
  }

  /// Places recorded before their session's attached parts were known still show them. Returns how
  /// many of the similar candidates were removed.
  std::size_t remove_alike_by_attached_parts(Observation& seen) const {
    if (options_.decision.count_matches) return 0;
    const bool are_known = attached_parts_.are_known(seen.features.working_size_px);
    const auto is_alike = [&](const VerifiedCandidate& v) {
      const PlaceId place = v.candidate.place;
      return v.geometry &&
             (!are_known || places_.steps_into_session(place) < AttachedParts::kFirstViews) &&
             AttachedParts::may_be_all(seen.features, features(place, seen), v.geometry->inliers);
    };
    const auto similar = std::span(seen.verified).first(seen.candidates.num_similar);
    const auto removed = static_cast<std::size_t>(std::ranges::count_if(similar, is_alike));
    std::erase_if(seen.verified, is_alike);
    return removed;
  }

  /// See RankedPlace::score.
  [[nodiscard]] double score(const VerifiedCandidate& v, const Observation& seen) const {
    if (options_.decision.count_matches) return v.geometry ? v.geometry->matches : 0;
    return seen.update.belief.at(v.step);
  }

  void decide(Observation& seen, Belief prior, std::size_t num_similar,
              Detection& detection) const {
    const FrameCandidates& candidates = seen.candidates;
    const DecisionOptions& decision = options_.decision;
    if (std::ranges::none_of(seen.verified, &VerifiedCandidate::may_match)) {
      detection.status = places_.contents().any_before(candidates.end) ? Status::no_similar_place
                                                                       : Status::no_earlier_place;
    }
    if (decision.count_matches) return decide_by_matches(seen, detection);
    const PlaceFilter::Steps steps{
        .number = places_.steps_before(candidates.end),
        .may_be_at =
            [&](std::ptrdiff_t step) {
              const auto place = places_.place_of(step);
              return place && candidates.may_match(*place);
            },
        .return_weight =
            [&](std::ptrdiff_t step) {
              const auto place = candidates.reach ? places_.place_of(step) : std::nullopt;
              if (!place) return 1.0;
              return Reach::weight(odometry_.chi2(*candidates.reach, *place, candidates.end));
            },
        .is_step = seen.view.look.is_step,
        .votes_just_left = seen.votes_just_left};
    seen.update = place_filter_.update(std::move(prior), seen.verified, num_similar, steps,
                                       places_.known_loops());
    if (!seen.update.match) return;
    report_match(seen.verified[*seen.update.match], seen, detection);
    detection.score = seen.update.probability;
    detection.terms = seen.update.terms;
    detection.status = seen.update.probability >= decision.min_score ? Status::loop
                       : seen.update.revisit >= decision.min_score
                           ? Status::ambiguous
                           : reason_of_rejection(*seen.best->geometry, options_.verification);
  }

  /// Evidence of a place out of reach, where there is no loop: either that place looks like this
  /// one, or odometry is wrong.
  void report_unreachable(Observation& seen, Detection& detection) const {
    constexpr std::size_t kLooks = 3;
    constexpr double kEvident = 0.5;
    std::vector<Candidate>& too_far = seen.candidates.too_far;
    if (detection.status == Status::loop || too_far.empty()) return;
    too_far.resize(std::min(kLooks, too_far.size()));
    const auto verified =
        seen.work->candidates.verify(verified_query(seen), too_far, too_far.size());
    const VerifiedCandidate* best = nullptr;
    double most = std::min(kEvident, options_.decision.min_score);
    for (const VerifiedCandidate& v : verified) {
      const double probability = probability_alone(v, seen.candidates.end);
      if (probability < most) continue;
      most = probability;
      best = &v;
    }
    if (best == nullptr) return;
    detection.match.reset();
    detection.earlier_match.reset();
    report_match(*best, seen, detection);
    detection.status = Status::unreachable;
    detection.score = 0;
    detection.terms.reset();
  }

  [[nodiscard]] double probability_alone(const VerifiedCandidate& v, PlaceId end) const {
    if (!v.geometry) return 0;
    if (options_.decision.count_matches) {
      return v.geometry->matches >= options_.decision.min_score ? 1 : 0;
    }
    return place_filter_.probability_alone(*v.geometry, places_.steps_before(end));
  }

  /// What the frame tells of those before it.
  void report_earlier_frames(Observation& seen, Detection& detection) const {
    const DecisionOptions& decision = options_.decision;
    if (decision.count_matches) return;
    seen.changed = late_loops_.find(seen.update, seen.view.look.is_step, decision.min_score,
                                    places_.known_loops());
    for (const LateLoops::Loop& loop : seen.changed.late) {
      detection.late_loops.push_back(late_loop(loop));
    }
    for (const LateLoops::Loop& loop : seen.changed.withdrawn) {
      detection.withdrawn_loops.push_back(late_loop(loop));
    }
  }

  [[nodiscard]] LateLoop late_loop(const LateLoops::Loop& loop) const {
    LateLoop late{.frame = loop.frame - places_.session_begin(),
                  .score = loop.probability,
                  .similarity = loop.similarity};
    set_match(loop.match, late);
    return late;
  }

  /// `Found`: a Detection or a LateLoop.
  template <typename Found>
  void set_match(PlaceId place, Found& found) const {
    if (place < places_.session_begin()) {
      found.earlier_match = places_.origin(place);
    } else {
      found.match = place - places_.session_begin();
    }
  }

  /// As in the paper.
  void decide_by_matches(Observation& seen, Detection& detection) const {
    const auto best = std::ranges::max_element(seen.verified, {}, [&](const auto& v) {
      return std::tuple(v.may_match, score(v, seen), v.candidate.similarity);
    });
    if (best == seen.verified.end() || !best->may_match) return;
    report_match(*best, seen, detection);
    detection.score = score(*seen.best, seen);
    detection.status = detection.score >= options_.decision.min_score
                           ? Status::loop
                           : reason_of_rejection(*seen.best->geometry, options_.verification);
  }

  void report_match(const VerifiedCandidate& best, Observation& seen, Detection& detection) const {
    std::vector<VerifiedCandidate> match{best};
    seen.work->candidates.complete(verified_query(seen), match);
    seen.best = match.front();
    set_match(seen.best->candidate.place, detection);
    detection.similarity = seen.best->candidate.similarity;
    detection.matches = seen.best->geometry->matches;
    detection.inliers = static_cast<int>(seen.best->geometry->inliers.size());
  }

  LoopDetectorOptions options_;
  cv::Mat1b mask_;          ///< of all images; empty = none
  BinaryContent excluded_;  ///< by the mask
  std::optional<CameraModel> camera_;
  Places places_;
  ExclusionWindow window_;
  SessionOdometry odometry_;
  CandidateFinder finder_;
  AttachedParts attached_parts_;
  CandidateFilter filter_;
  PlaceFilter place_filter_;
  LateLoops late_loops_;
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
  return process(image, timestamp_s, std::nullopt, evidence, allowed);
}

Detection LoopDetector::process(const cv::Mat& image, std::optional<double> timestamp_s,
                                const std::optional<OdometryPose>& odometry, Evidence* evidence,
                                const AllowedPlaces& allowed) {
  return process(prepare(image), timestamp_s, odometry, evidence, allowed);
}

PreparedImage LoopDetector::prepare(const cv::Mat& image) const { return impl_->prepare(image); }

Detection LoopDetector::process(PreparedImage prepared, std::optional<double> timestamp_s,
                                const std::optional<OdometryPose>& odometry, Evidence* evidence,
                                const AllowedPlaces& allowed) {
  impl_->learn();
  Impl::Observation seen = impl_->observation();
  const cv::Mat image = prepared.image;
  Detection detection = impl_->detect(std::move(prepared), {timestamp_s, odometry}, allowed, seen);
  if (evidence) *evidence = impl_->evidence(seen, detection);
  impl_->remember(std::move(seen), detection, image);
  return detection;
}

Detection LoopDetector::process(const BinaryContent& content, Features features,
                                std::optional<double> timestamp_s,
                                const std::optional<OdometryPose>& odometry) {
  impl_->learn();
  Impl::Observation seen = impl_->observation();
  seen.content = content;
  seen.features = std::move(features);
  Detection detection = impl_->detect({timestamp_s, odometry}, seen);
  impl_->remember(std::move(seen), detection, cv::Mat());
  return detection;
}

Detection LoopDetector::query(const cv::Mat& image, std::optional<double> timestamp_s,
                              std::vector<RankedPlace>* ranking, Evidence* evidence,
                              const AllowedPlaces& allowed) const {
  return query(prepare(image), timestamp_s, ranking, evidence, allowed);
}

Detection LoopDetector::query(const PreparedImage& prepared, std::optional<double> timestamp_s,
                              std::vector<RankedPlace>* ranking, Evidence* evidence,
                              const AllowedPlaces& allowed) const {
  Impl::Observation seen = impl_->observation();
  Detection detection = impl_->detect(prepared, {timestamp_s, std::nullopt}, allowed, seen);
  if (evidence) *evidence = impl_->evidence(seen, detection);
  if (ranking) *ranking = impl_->ranked(seen, detection);
  return detection;
}

Detection LoopDetector::skip(std::optional<double> timestamp_s,
                             const std::optional<OdometryPose>& odometry) {
  return impl_->skip({timestamp_s, odometry});
}

void LoopDetector::set_mask(const cv::Mat& mask) { impl_->set_mask(mask); }

void LoopDetector::set_camera(const std::optional<CameraModel>& camera) {
  impl_->set_camera(camera);
}

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

Features LoopDetector::features_of(const SessionFrame& place) const {
  return impl_->features_of(place);
}

PlaceId LoopDetector::size() const { return impl_->size(); }

const LoopDetectorOptions& LoopDetector::options() const { return impl_->options(); }

}  // namespace loopbit
