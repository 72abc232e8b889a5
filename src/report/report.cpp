// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/base64.hpp"
#include "loopbit/error.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/growing_report.hpp"
#include "loopbit/judge.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/revisits.hpp"
#include "loopbit/version.hpp"
#include "loopbit/write_file.hpp"

#include "loop_poses.hpp"
#include "pictures.hpp"
#include "report_json.hpp"
#include "report_page.hpp"
#include "similarity_matrix.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;
using report::FrameView;

constexpr std::string_view kDataPlace = "@REPORT_DATA@";
// Of the page's Content-Security-Policy.
constexpr std::string_view kNoConnection = "connect-src 'none'";
constexpr std::string_view kOwnConnection = "connect-src 'self'";

struct FrameCount {
  int frames = 0;
  bool is_known = false;  ///< else there may be more
};

std::int64_t listed_frames(const ReportRun& run) {
  return static_cast<std::int64_t>(run.list.times_s.size());
}

/// The smallest number of frames that contains everything reported. `truth` is in frames of the
/// run.
std::int64_t least_frames(const MatchList& list, const std::optional<GroundTruth>& truth) {
  int last = -1;
  for (const ReportedMatch& match : list.matches) last = std::max({last, match.query, match.match});
  for (const int query : list.elsewhere) last = std::max(last, query);
  if (truth) {
    for (const PlaceRun& run : truth->same_place) last = std::max(last, run.query);
    for (const PlaceRun& run : truth->near_place) last = std::max(last, run.query);
    for (const int query : truth->ignored) last = std::max(last, query);
  }
  return std::int64_t{last} + 1;
}

/// Throws Error (kind input) if a page cannot show that many.
int checked(std::int64_t frames, const std::string& name) {
  constexpr std::int64_t kMaxShown = 2'000'000;
  if (frames <= kMaxShown) return static_cast<int>(frames);
  throw Error(ErrorKind::input,
              fmt::format("'{}' has {} frames, but a page shows at most {}; leave out frames, "
                          "or use 'loopbit eval', which needs none.",
                          name, frames, kMaxShown));
}

/// If a detector lists no frames, uses those of the other runs on the same images, or the number of
/// positions.
FrameCount frame_count(const ReportRun& run, const std::optional<GroundTruth>& truth,
                       const std::vector<ReportRun>& runs) {
  if (const std::int64_t listed = listed_frames(run); listed > 0) {
    return {checked(listed, run.name), true};
  }
  auto known = static_cast<std::int64_t>(run.positions_m.size());
  for (const ReportRun& other : runs) known = std::max(known, listed_frames(other));
  const std::int64_t least = least_frames(run.list, truth);
  return {checked(std::max(known, least), run.name), known > 0 && known >= least};
}

/// The match that counts for each frame: accepted before rejected, then by score.
std::vector<const ReportedMatch*> best_matches(const MatchList& list, int frames) {
  std::vector<const ReportedMatch*> best(static_cast<std::size_t>(frames));
  for (const ReportedMatch& match : list.matches) {
    if (match.query >= frames) continue;
    const ReportedMatch*& slot = best[static_cast<std::size_t>(match.query)];
    if (!slot || std::pair(match.is_loop, match.score) > std::pair(slot->is_loop, slot->score)) {
      slot = &match;
    }
  }
  return best;
}

/// The frames whose accepted match is not a frame of this run.
std::vector<bool> loops_elsewhere(const MatchList& list, int frames) {
  std::vector<bool> elsewhere(static_cast<std::size_t>(frames));
  for (const int query : list.elsewhere) {
    if (query < frames) elsewhere[static_cast<std::size_t>(query)] = true;
  }
  return elsewhere;
}

std::string verdict_of(int frame, const ReportedMatch* match, bool is_elsewhere,
                       const Judge* judge) {
  const bool is_loop = is_elsewhere || (match && match->is_loop);
  if (!judge) return is_loop ? "loop" : "none";
  if (judge->is_ignored(frame)) return "ignored";
  if (is_elsewhere) return "elsewhere";
  const auto judgement = is_loop ? std::optional(judge->judge(frame, match->match)) : std::nullopt;
  if (judgement == Judgement::right) return "right";
  if (judgement == Judgement::wrong) return "wrong";
  if (judge->is_positive(frame)) return "missed";
  return judgement == Judgement::tolerated ? "tolerated" : "none";
}

/// One true place per query: the middle of its first run.
std::unordered_map<int, int> true_places(const std::optional<GroundTruth>& truth) {
  std::unordered_map<int, int> places;
  if (!truth) return places;
  for (const PlaceRun& run : truth->same_place) {
    places.try_emplace(run.query, run.first + (run.last - run.first) / 2);
  }
  return places;
}

/// `truth` is in frames of the run.
std::vector<FrameView> frame_views(const ReportRun& run, const std::optional<GroundTruth>& truth,
                                   int frames) {
  const auto judge =
      run.truth ? std::optional<Judge>(std::in_place, *run.truth, run.evaluation) : std::nullopt;
  const auto best = best_matches(run.list, frames);
  const auto elsewhere = loops_elsewhere(run.list, frames);
  const auto places = true_places(truth);
  std::vector<FrameView> views;
  views.reserve(best.size());
  for (int frame = 0; frame < frames; ++frame) {
    const ReportedMatch* match = best[static_cast<std::size_t>(frame)];
    const bool is_elsewhere = elsewhere[static_cast<std::size_t>(frame)];
    FrameView view{.frame = frame,
                   .verdict = verdict_of(frame, match, is_elsewhere, judge ? &*judge : nullptr)};
    if (match) view.partners.push_back(match->match);
    if (match && match->is_loop) view.loop_score = match->score;
    if (view.verdict == "missed" || view.verdict == "wrong") {
      if (const auto place = places.find(frame); place != places.end()) {
        view.partners.push_back(place->second);
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

Json flat(const std::vector<PlaceRun>& runs) {
  Json json = Json::array();
  for (const PlaceRun& run : runs) {
    for (const int number : {run.query, run.first, run.last}) json.push_back(number);
  }
  return json;
}

Json evaluation_json(const ReportRun& run) {
  if (!run.truth) return nullptr;
  return Json::parse(to_json(evaluate(run.list, *run.truth, run.evaluation), true));
}

template <typename Of>
Json column(const std::vector<Detection>& detections, const Of& of) {
  Json json = Json::array();
  for (const Detection& detection : detections) json.push_back(of(detection));
  return json;
}

/// Best candidates in earlier sessions of the map, as pairs session, frame; null if none has one.
Json earlier_matches(const std::vector<Detection>& detections) {
  const auto has_one = [](const Detection& d) { return d.earlier_match.has_value(); };
  if (std::none_of(detections.begin(), detections.end(), has_one)) return nullptr;
  return column(detections, [](const Detection& d) {
    return d.earlier_match ? Json{d.earlier_match->session, d.earlier_match->frame} : Json();
  });
}

/// What later frames changed: of each frame that changed something, a list of frame, match (a
/// number, session and frame, or null), score and whether the loop was withdrawn; otherwise null.
/// Null if none did.
Json late_column(const std::vector<Detection>& detections) {
  const auto changed = [](const Detection& d) {
    return !d.late_loops.empty() || !d.withdrawn_loops.empty();
  };
  if (std::none_of(detections.begin(), detections.end(), changed)) return nullptr;
  return column(detections, [&](const Detection& d) {
    if (!changed(d)) return Json();
    Json all = Json::array();
    const auto add = [&](const LateLoop& loop, bool is_withdrawn) {
      Json match = loop.match ? Json(*loop.match) : Json();
      if (loop.earlier_match) match = {loop.earlier_match->session, loop.earlier_match->frame};
      all.push_back({loop.frame, match, loop.score, is_withdrawn});
    };
    for (const LateLoop& loop : d.withdrawn_loops) add(loop, true);
    for (const LateLoop& loop : d.late_loops) add(loop, false);
    return all;
  });
}

/// Null where a frame has none; shown with one decimal.
Json terms_columns(const std::vector<Detection>& detections) {
  const auto term = [&](double ScoreTerms::*member) {
    return column(detections, [&](const Detection& d) {
      return d.terms ? Json(std::round(*d.terms.*member * 100) / 100) : Json();
    });
  };
  return {{"votes", term(&ScoreTerms::votes)},
          {"geometry", term(&ScoreTerms::geometry)},
          {"path", term(&ScoreTerms::path)},
          {"rivals", term(&ScoreTerms::rivals)},
          {"prior", term(&ScoreTerms::prior)}};
}

/// The columns of loops.csv that lists of other detectors lack.
void add_own_columns(Json& json, const std::vector<Detection>& detections) {
  const auto time = [&](double StepTimes::*step) {
    return column(detections, [&](const Detection& d) { return d.times.*step; });
  };
  Json names = Json::array();
  for (const Status status : kAllStatuses) names.push_back(to_string(status));
  json["status_names"] = names;
  json["status"] =
      column(detections, [](const Detection& d) { return static_cast<int>(d.status); });
  json["earlier_match"] = earlier_matches(detections);
  json["score"] = column(detections, [](const Detection& d) { return d.score; });
  json["late_loops"] = late_column(detections);
  json["terms"] = terms_columns(detections);
  json["similarity"] = column(detections, [](const Detection& d) { return d.similarity; });
  json["matches"] = column(detections, [](const Detection& d) { return d.matches; });
  json["inliers"] = column(detections, [](const Detection& d) { return d.inliers; });
  json["times_ms"] = {{"content", time(&StepTimes::content_ms)},
                      {"retrieval", time(&StepTimes::retrieval_ms)},
                      {"features", time(&StepTimes::features_ms)},
                      {"verification", time(&StepTimes::verification_ms)}};
}

void add_match_columns(Json& json, const MatchList& list, int frames) {
  json["timestamp_s"] = nullptr;
  const auto has_time = [](const auto& time) { return time.has_value(); };
  if (std::any_of(list.times_s.begin(), list.times_s.end(), has_time)) {
    json["timestamp_s"] = Json::array();
    for (const auto& time : list.times_s) {
      json["timestamp_s"].push_back(time ? Json(*time) : Json());
    }
  }
  json["status_names"] = {"loop", "no_loop"};
  for (const char* name : {"status", "match", "score"}) json[name] = Json::array();
  const auto elsewhere = loops_elsewhere(list, frames);
  const auto best = best_matches(list, frames);
  for (std::size_t frame = 0; frame < best.size(); ++frame) {
    const ReportedMatch* match = best[frame];
    json["status"].push_back(elsewhere[frame] || (match && match->is_loop) ? 0 : 1);
    json["match"].push_back(match ? match->match : -1);
    json["score"].push_back(match ? Json(match->score) : Json());
  }
  for (const char* name :
       {"earlier_match", "late_loops", "terms", "similarity", "matches", "inliers", "times_ms"}) {
    json[name] = nullptr;
  }
}

Json names_column(const std::vector<Detection>& detections) {
  const auto has_name = [](const Detection& d) { return !d.name.empty(); };
  if (std::none_of(detections.begin(), detections.end(), has_name)) return nullptr;
  return column(detections, [](const Detection& d) { return d.name; });
}

/// Of the images, by the first run that knows them: all runs are on the same images. Null if none.
Json names_of(int frames, const std::vector<ReportRun>& runs) {
  for (const ReportRun& run : runs) {
    if (!run.run || run.run->detections.size() != static_cast<std::size_t>(frames)) continue;
    if (Json names = names_column(run.run->detections); !names.is_null()) return names;
  }
  return nullptr;
}

Json revisits_json(const MatchList& list) {
  Json json = Json::array();
  for (const Revisit& one : revisits(list)) {
    json.push_back({{"query", {one.first_query, one.last_query}},
                    {"match", {one.first_match, one.last_match}},
                    {"loops", one.loops}});
  }
  return json;
}

/// The two axes with the largest extent of the positions.
std::array<int, 2> plane(const std::vector<std::optional<cv::Vec3d>>& positions_m) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 3> low{kInfinity, kInfinity, kInfinity};
  std::array<double, 3> high{-kInfinity, -kInfinity, -kInfinity};
  for (const auto& position : positions_m) {
    if (!position) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], (*position)[static_cast<int>(axis)]);
      high[axis] = std::max(high[axis], (*position)[static_cast<int>(axis)]);
    }
  }
  std::size_t flattest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis) {
    if (high[axis] - low[axis] < high[flattest] - low[flattest]) flattest = axis;
  }
  return {flattest == 0 ? 1 : 0, flattest == 2 ? 1 : 2};
}

std::string axis_name(int axis) { return std::string(1, static_cast<char>('x' + axis)); }

/// In the plane of two axes.
Json positions(const std::vector<std::optional<cv::Vec3d>>& positions_m,
               const std::array<int, 2>& axes) {
  const auto [across, along] = axes;
  Json x = Json::array();
  Json y = Json::array();
  for (const auto& position : positions_m) {
    x.push_back(position ? Json((*position)[across]) : Json());
    y.push_back(position ? Json((*position)[along]) : Json());
  }
  return {{"x_m", x}, {"y_m", y}, {"axes", {axis_name(across), axis_name(along)}}};
}

/// Null if none is known.
Json positions(std::vector<std::optional<cv::Vec3d>> positions_m, int frames) {
  positions_m.resize(static_cast<std::size_t>(frames));
  const auto has_position = [](const auto& position) { return position.has_value(); };
  if (std::none_of(positions_m.begin(), positions_m.end(), has_position)) return nullptr;
  return positions(positions_m, plane(positions_m));
}

/// Positions by odometry and corrected in the plane of the latter, by frame, and the judged loops
/// as flat triples query, match, and 1 if it is kept. Null if nothing was corrected.
Json correction_json(const FinishedRun& run, int frames) {
  if (run.trajectory.empty()) return nullptr;
  const auto count = static_cast<std::size_t>(frames);
  std::vector<std::optional<cv::Vec3d>> before(count);
  std::vector<std::optional<cv::Vec3d>> after(count);
  for (const CorrectedPosition& position : run.trajectory) {
    const auto frame = static_cast<std::size_t>(position.frame);
    if (frame >= count) continue;
    before[frame] = position.odometry_m;
    after[frame] = position.corrected_m;
  }
  Json loops = Json::array();
  for (const LoopJudgement& loop : run.judged_loops) {
    for (const int number : {loop.query, loop.match, loop.verdict == LoopVerdict::kept ? 1 : 0}) {
      loops.push_back(number);
    }
  }
  const auto axes = plane(after);
  return {{"before", positions(before, axes)}, {"after", positions(after, axes)}, {"loops", loops}};
}

/// Always includes the match of every frame, even if other pairs are left out.
Json matrix_json(const EvidenceReader& evidence, const MatchList& list, int frames,
                 int shift_tolerance_columns) {
  std::vector<BinaryContent> contents(static_cast<std::size_t>(frames));
  evidence.for_each_content([&](PlaceId frame, const BinaryContent& content) {
    if (frame >= 0 && frame < frames) contents[static_cast<std::size_t>(frame)] = content;
  });
  const auto matrix = report::similarity_matrix(contents, list.matches, shift_tolerance_columns);
  if (matrix.cells.empty()) return nullptr;
  std::vector<unsigned char> png;
  cv::imencode(".png", matrix.cells, png);
  return {{"side", matrix.cells.rows},
          {"frames_per_cell", matrix.frames_per_cell},
          {"compared_every", matrix.compared_every},
          {"png", base64(png)}};
}

bool is_same(const GroundTruth& a, const GroundTruth& b) {
  return a.every == b.every && a.same_place == b.same_place && a.near_place == b.near_place &&
         a.ignored == b.ignored && a.unknown == b.unknown;
}

/// The description of the truth in the run that was given it; null if no run has one.
Json source_of(const GroundTruth& truth, const std::vector<ReportRun>& runs) {
  for (const ReportRun& run : runs) {
    if (!run.run || !run.run->truth || !is_same(truth, *run.run->truth)) continue;
    if (run.run->record && !run.run->record->truth.empty()) return run.run->record->truth;
  }
  return nullptr;
}

Json run_json(const ReportRun& run, const std::vector<ReportRun>& runs,
              std::size_t max_picture_bytes) {
  const auto truth =
      run.truth ? std::optional(every_nth(*run.truth, run.truth->every)) : std::nullopt;
  const auto [frames, is_known] = frame_count(run, truth, runs);
  const bool has_record = run.run && run.run->record;  // unless it was cut off
  const std::vector<FrameView> views = frame_views(run, truth, frames);
  Json json{{"name", run.name},
            {"record", has_record ? Json::parse(run.run->record_json) : Json()},
            {"threshold", nullptr},
            {"frames", frames},
            {"frames_known", is_known}};
  add_match_columns(json, run.list, frames);
  json["verdict"] = Json::array();
  for (const FrameView& view : views) json["verdict"].push_back(view.verdict);
  json["first_frame"] = report::first_frame(views);
  json["truth"] = nullptr;
  if (truth) {
    json["truth"] = {{"same_place", flat(truth->same_place)},
                     {"near_place", flat(truth->near_place)},
                     {"source", source_of(*run.truth, runs)}};
  }
  json["names"] = names_of(frames, runs);
  json["revisits"] = revisits_json(run.list);
  json["evaluation"] = evaluation_json(run);
  json["positions"] = positions(run.positions_m, frames);
  json["similarity_matrix"] = nullptr;
  json["pictures"] = Json::object();
  json["poses"] = nullptr;
  json["correction"] = nullptr;
  if (!run.run) return json;

  LoopDetectorOptions options;
  if (has_record) {
    options = run.run->record->options;
    json["threshold"] = options.decision.min_score;
  }
  add_own_columns(json, run.run->detections);
  if (!run.run->evidence_path.empty()) {
    const EvidenceReader evidence(run.run->evidence_path);
    json["similarity_matrix"] =
        matrix_json(evidence, run.list, frames, options.retrieval.shift_tolerance_columns);
    json["pictures"] = report::pictures(views, evidence, max_picture_bytes);
  }
  json["poses"] = report::loop_poses(*run.run, json["pictures"]);
  json["correction"] = correction_json(*run.run, frames);
  return json;
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

std::string with_data(std::string page, std::string json) {
  // The data must not close the HTML element that contains it.
  replace_all(json, "<", "\\u003c");
  page.replace(page.find(kDataPlace), kDataPlace.size(), json);
  return page;
}

}  // namespace

std::string report_json(const std::vector<ReportRun>& runs, const ReportOptions& options) {
  constexpr double kBytesPerMb = 1e6;
  const double max_bytes = options.max_pictures_mb * kBytesPerMb /
                           static_cast<double>(std::max<std::size_t>(1, runs.size()));
  Json json{{"loopbit", kVersion},
            {"default_options", Json::parse(to_json(LoopDetectorOptions{}))},
            {"runs", Json::array()}};
  for (const ReportRun& run : runs) {
    json["runs"].push_back(run_json(run, runs, static_cast<std::size_t>(max_bytes)));
  }
  return text_of(json);
}

ReportRun to_report_run(const std::string& name, FinishedRun run) {
  ReportRun made;
  made.name = name;
  made.list = match_list(run.detections);
  made.positions_m = run.positions_m;
  made.truth = run.truth;
  made.evaluation = run.scoring().evaluation;
  made.run = std::move(run);
  return made;
}

void write_report(const std::string& path, const std::vector<ReportRun>& runs,
                  const ReportOptions& options) {
  write_file(path, with_data(std::string(report::kPage), report_json(runs, options)));
}

std::string growing_report(const std::string& name, const std::string& record_json,
                           const std::string& id) {
  Json json = Json::parse(report_json({to_report_run(name, {})}));
  Json& run = json["runs"][0];
  run["record"] = Json::parse(record_json);
  run["threshold"] = run["record"]["options"]["decision"]["min_score"];
  run["frames_known"] = true;
  json["live"] = id;
  std::string page(report::kPage);
  replace_all(page, kNoConnection, kOwnConnection);
  return with_data(std::move(page), text_of(json));
}

std::string report_columns(const std::vector<Detection>& detections) {
  Json json;
  json["timestamp_s"] = column(
      detections, [](const Detection& d) { return d.timestamp_s ? Json(*d.timestamp_s) : Json(); });
  json["match"] = column(detections, [](const Detection& d) { return d.match.value_or(-1); });
  json["verdict"] = column(
      detections, [](const Detection& d) { return d.status == Status::loop ? "loop" : "none"; });
  json["names"] = names_column(detections);
  add_own_columns(json, detections);
  return text_of(json);
}

std::string report_picture(const StoredEvidence& evidence) {
  return report::picture(evidence).dump();
}

}  // namespace loopbit
