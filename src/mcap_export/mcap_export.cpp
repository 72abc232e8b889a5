// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/mcap_export.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/base64.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/judge.hpp"
#include "loopbit/mcap_writer.hpp"

#include "foxglove_schemas.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFrameId = "map";
constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;
/// Between frames without times.
constexpr std::uint64_t kPeriod_ns = kNanosecondsPerSecond / 10;
/// An entity of the path is sent again with each frame until it has so many.
constexpr std::size_t kFramesPerStretch = 100;

struct Colour {
  double r, g, b;
};

// Okabe and Ito (2008), as in the report.
constexpr Colour kPathColour{0.6, 0.63, 0.66};
constexpr Colour kCameraColour{0.9, 0.62, 0.0};
constexpr Colour kLoopColour{0.0, 0.62, 0.45};
constexpr Colour kWrongColour{0.84, 0.37, 0.0};

using Place = std::optional<cv::Vec3d>;

/// Nanoseconds, never falling: those of the frames if all have a time.
std::vector<std::uint64_t> times_of(const std::vector<Detection>& detections) {
  const auto is_timed = [](const Detection& d) { return d.timestamp_s && *d.timestamp_s >= 0; };
  const bool are_timed = std::all_of(detections.begin(), detections.end(), is_timed);
  std::vector<std::uint64_t> times_ns;
  for (const Detection& detection : detections) {
    const std::uint64_t time_ns =
        are_timed ? static_cast<std::uint64_t>(std::llround(1e9 * *detection.timestamp_s))
                  : times_ns.size() * kPeriod_ns;
    times_ns.push_back(times_ns.empty() ? time_ns : std::max(time_ns, times_ns.back()));
  }
  return times_ns;
}

/// Camera centres; without any, the frames on a ring, clockwise from the top, one metre apart.
std::vector<Place> places_of(const FinishedRun& run) {
  const std::size_t frames = run.detections.size();
  std::vector<Place> places = run.positions_m;
  places.resize(frames);
  if (std::any_of(places.begin(), places.end(), [](const Place& at) { return at.has_value(); })) {
    return places;
  }
  const double radius_m = static_cast<double>(frames) / (2 * std::numbers::pi);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double angle =
        2 * std::numbers::pi * static_cast<double>(frame) / static_cast<double>(frames);
    places[frame] = radius_m * cv::Vec3d(std::sin(angle), std::cos(angle), 0);
  }
  return places;
}

Json time_json(std::uint64_t time_ns) {
  return {{"sec", time_ns / kNanosecondsPerSecond}, {"nsec", time_ns % kNanosecondsPerSecond}};
}

Json point_json(const cv::Vec3d& at) { return {{"x", at[0]}, {"y", at[1]}, {"z", at[2]}}; }

Json pose_json(const cv::Vec3d& at) {
  return {{"position", point_json(at)},
          {"orientation", {{"x", 0.0}, {"y", 0.0}, {"z", 0.0}, {"w", 1.0}}}};
}

Json colour_json(const Colour& colour) {
  return {{"r", colour.r}, {"g", colour.g}, {"b", colour.b}, {"a", 1.0}};
}

Json entity(const std::string& id, std::uint64_t time_ns) {
  Json json{{"timestamp", time_json(time_ns)},
            {"frame_id", kFrameId},
            {"id", id},
            {"lifetime", time_json(0)},  // for ever
            {"frame_locked", false}};
  for (const char* list : {"metadata", "arrows", "cubes", "spheres", "cylinders", "lines",
                           "triangles", "texts", "models"}) {
    json[list] = Json::array();
  }
  return json;
}

Json line_json(const std::vector<cv::Vec3d>& points, double thickness_px, const Colour& colour) {
  constexpr int kLineStrip = 0;
  Json json{{"type", kLineStrip},      {"pose", pose_json({})},   {"thickness", thickness_px},
            {"scale_invariant", true}, {"points", Json::array()}, {"color", colour_json(colour)},
            {"colors", Json::array()}, {"indices", Json::array()}};
  for (const cv::Vec3d& point : points) json["points"].push_back(point_json(point));
  return json;
}

/// JSON has no infinities.
double finite(double value) {
  constexpr double kMost = std::numeric_limits<double>::max();
  return std::isnan(value) ? 0.0 : std::clamp(value, -kMost, kMost);
}

/// `Found`: a Detection or a LateLoop.
template <typename Found>
void add_match(const Found& found, Json& json) {
  if (found.match) json["match"] = *found.match;
  if (found.earlier_match) {
    json["earlier_session"] = found.earlier_match->session;
    json["earlier_frame"] = found.earlier_match->frame;
  }
}

Json late_json(const std::vector<LateLoop>& loops) {
  Json list = Json::array();
  for (const LateLoop& loop : loops) {
    Json json{{"frame", loop.frame}, {"score", loop.score}, {"similarity", loop.similarity}};
    add_match(loop, json);
    list.push_back(json);
  }
  return list;
}

Json detection_json(const Detection& detection, double threshold, std::uint64_t time_ns) {
  const StepTimes& times = detection.times;
  Json json{{"timestamp", time_json(time_ns)},
            {"frame", detection.frame},
            {"name", detection.name},
            {"status", to_string(detection.status)},
            {"is_loop", detection.status == Status::loop},
            {"score", finite(detection.score)},
            {"threshold", threshold},
            {"similarity", detection.similarity},
            {"matches", detection.matches},
            {"inliers", detection.inliers},
            {"times_ms",
             {{"content", times.content_ms},
              {"retrieval", times.retrieval_ms},
              {"features", times.features_ms},
              {"verification", times.verification_ms},
              {"total", total_ms(times)}}}};
  if (const auto& terms = detection.terms) {
    json["terms"] = {{"votes", terms->votes},
                     {"geometry", terms->geometry},
                     {"path", terms->path},
                     {"rivals", terms->rivals},
                     {"prior", terms->prior}};
  }
  add_match(detection, json);
  json["late_loops"] = late_json(detection.late_loops);
  json["withdrawn_loops"] = late_json(detection.withdrawn_loops);
  return json;
}

std::string loop_id(PlaceId frame) { return fmt::format("loop {}", frame); }

/// Of what the entity with this id shows.
Json deletion(const std::string& id, std::uint64_t time_ns) {
  constexpr int kMatchingId = 0;
  return {{"timestamp", time_json(time_ns)}, {"type", kMatchingId}, {"id", id}};
}

/// Writes the messages of one frame after the other.
class Export {
 public:
  Export(const std::string& path, const FinishedRun& run) : places_(places_of(run)), file_(path) {
    if (run.truth) judge_.emplace(*run.truth, run.scoring().evaluation);
    if (!run.evidence_path.empty()) evidence_.emplace(run.evidence_path);
    if (run.record) threshold_ = run.record->options.decision.min_score;
    scene_ = file_.add_topic("/loopbit/scene", "foxglove.SceneUpdate", scene_schema());
    detections_ = file_.add_topic("/loopbit/detection", "loopbit.Detection", detection_schema());
    query_ = file_.add_topic("/loopbit/query", "foxglove.CompressedImage", image_schema());
    match_ = file_.add_topic("/loopbit/match", "foxglove.CompressedImage", image_schema());
  }

  void add(const Detection& detection, std::uint64_t time_ns) {
    write(detections_, time_ns, detection_json(detection, threshold_, time_ns));
    write(scene_, time_ns, scene(detection, time_ns));
    add_picture(query_, detection.frame, time_ns);
    if (detection.status == Status::loop && detection.match) {
      add_picture(match_, *detection.match, time_ns);
    }
  }

  void finish() { file_.finish(); }

 private:
  void write(std::uint16_t topic, std::uint64_t time_ns, const Json& json) {
    // A name need not be UTF-8, which JSON is.
    file_.add(topic, time_ns, json.dump(-1, ' ', false, Json::error_handler_t::replace));
  }

  void add_picture(std::uint16_t topic, PlaceId frame, std::uint64_t time_ns) {
    StoredEvidence stored;
    if (!evidence_ || !evidence_->read(frame, stored)) return;
    write(topic, time_ns,
          {{"timestamp", time_json(time_ns)},
           {"frame_id", "camera"},
           {"data", base64(stored.picture_jpeg)},
           {"format", "jpeg"}});
  }

  /// The newest stretch of the path, the camera, the loop if there is one, and what changed of
  /// earlier frames.
  Json scene(const Detection& detection, std::uint64_t time_ns) {
    Json entities = Json::array();
    const Place& at = place(detection.frame);
    if (at) {
      stretch_.push_back(*at);
      Json path = entity(fmt::format("path {}", stretches_), time_ns);
      path["lines"].push_back(line_json(stretch_, 2, kPathColour));
      entities.push_back(path);
      Json camera = entity("camera", time_ns);
      camera["spheres"].push_back({{"pose", pose_json(*at)},
                                   {"size", point_json({0.6, 0.6, 0.6})},
                                   {"color", colour_json(kCameraColour)}});
      entities.push_back(camera);
      if (stretch_.size() > kFramesPerStretch) {
        stretch_ = {*at};  // where the next one goes on
        ++stretches_;
      }
    }
    if (detection.status == Status::loop) {
      add_loop(detection.frame, detection.match, detection.score, time_ns, entities);
    }
    Json deletions = Json::array();
    for (const LateLoop& loop : detection.withdrawn_loops) {
      deletions.push_back(deletion(loop_id(loop.frame), time_ns));
    }
    for (const LateLoop& loop : detection.late_loops) {
      add_loop(loop.frame, loop.match, loop.score, time_ns, entities);
    }
    return {{"deletions", deletions}, {"entities", entities}};
  }

  void add_loop(PlaceId frame, const std::optional<PlaceId>& match, double score,
                std::uint64_t time_ns, Json& entities) const {
    const Place& at = place(frame);
    const Place matched = match ? place(*match) : std::nullopt;
    if (!at || !matched) return;
    const bool is_wrong = judge_ && judge_->judge(frame, *match) == Judgement::wrong;
    Json loop = entity(loop_id(frame), time_ns);
    loop["lines"].push_back(line_json({*at, *matched}, 1.5, is_wrong ? kWrongColour : kLoopColour));
    loop["metadata"] = {{{"key", "match"}, {"value", std::to_string(*match)}},
                        {{"key", "score"}, {"value", fmt::format("{}", score)}}};
    entities.push_back(loop);
  }

  [[nodiscard]] const Place& place(PlaceId frame) const {
    return places_[static_cast<std::size_t>(frame)];
  }

  std::vector<Place> places_;
  recordings::McapWriter file_;
  std::optional<Judge> judge_;
  std::optional<EvidenceReader> evidence_;
  double threshold_ = 0;
  std::uint16_t scene_ = 0;
  std::uint16_t detections_ = 0;
  std::uint16_t query_ = 0;
  std::uint16_t match_ = 0;
  std::vector<cv::Vec3d> stretch_;
  int stretches_ = 0;
};

}  // namespace

void write_mcap(const std::string& path, const FinishedRun& run) {
  const std::vector<std::uint64_t> times_ns = times_of(run.detections);
  Export file(path, run);
  for (std::size_t i = 0; i < times_ns.size(); ++i) file.add(run.detections[i], times_ns[i]);
  file.finish();
}

}  // namespace loopbit
