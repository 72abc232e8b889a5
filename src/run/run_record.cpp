// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/run_record.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/evaluation_fields.hpp"
#include "loopbit/json_fields.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

// The fields of run.json, in order. `io` is a JsonWriter or a JsonReader.

template <typename Io, typename Options>
void transfer_options(Io& io, Options& options) {
  for_each_section(options, [&](std::string_view section, auto& part) {
    for_each_field<std::remove_cvref_t<decltype(part)>>([&](const auto& field) {
      io(fmt::format("/options/{}/{}", section, field.name), part.*field.member,
         static_cast<double>(field.min), static_cast<double>(field.max));
    });
  });
}

template <typename Io, typename Summary>
void transfer_times(Io& io, const std::string& place, Summary& times) {
  io(place + "/mean", times.mean);
  io(place + "/p50", times.p50);
  io(place + "/p99", times.p99);
  io(place + "/max", times.max);
}

template <typename Io, typename Record, typename Results>
void transfer_results(Io& io, Record& record, Results& results) {
  io("/counts/frames", results.frames);
  for (std::size_t i = 0; i < kAllStatuses.size(); ++i) {
    io(fmt::format("/counts/by_status/{}", to_string(kAllStatuses[i])), results.by_status[i]);
  }
  io("/counts/late_loops", results.late_loops);
  io("/counts/withdrawn_loops", results.withdrawn_loops);
  transfer_times(io, "/times_ms/content", results.content_ms);
  transfer_times(io, "/times_ms/retrieval", results.retrieval_ms);
  transfer_times(io, "/times_ms/features", results.features_ms);
  transfer_times(io, "/times_ms/verification", results.verification_ms);
  transfer_times(io, "/times_ms/total", results.total_ms);
  io("/wall_s", record.wall_s);
  io("/frames_per_s", results.frames_per_s);
  io("/peak_memory_mib", results.peak_memory_mib);
}

template <typename Io, typename Correcting>
void transfer_correction(Io& io, Correcting& correction) {
  io("/correction/keyframes", correction.keyframes);
  for (std::size_t i = 0; i < kAllLoopVerdicts.size(); ++i) {
    if (kAllLoopVerdicts[i] == LoopVerdict::undecided) continue;
    io(fmt::format("/correction/loops/{}", to_string(kAllLoopVerdicts[i])),
       correction.by_verdict[i]);
  }
  io("/correction/unjudged_loops", correction.unjudged);
  io.or_null("/correction/odometry_error_m", correction.odometry_error_m);
  io.or_null("/correction/corrected_error_m", correction.corrected_error_m);
}

template <typename Io, typename Record>
void transfer(Io& io, Record& record) {
  io("/loopbit", record.version);
  io("/arguments", record.arguments);
  io("/input/path", record.input);
  io("/input/description", record.description);
  io("/input/every", record.sampling.every, 1);
  io("/input/limit", record.sampling.limit);
  io.unless(std::string(), "/input/early_end", record.early_end);
  io("/stopped_by", record.stopped_by);
  transfer_options(io, record.options);
  io("/machine/processor", record.machine.processor);
  io("/machine/cores", record.machine.cores);
  io("/machine/kernel", record.machine.kernel);
  io("/machine/system", record.machine.system);
  io("/threads", record.threads);
  io.unless(std::string(), "/map/path", record.map_path);
  io.unless(0, "/map/reconnections", record.map_reconnections);
  io.unless(std::string(), "/map/queue", record.map_queue);
  io.unless(std::int64_t{0}, "/map/queued_frames", record.map_queued_frames);
  io.unless(std::int64_t{0}, "/map/unverified", record.map_unverified);
  io.unless(std::vector<std::string>(), "/map/not_asked", record.map_not_asked);
  io.unless(0, "/map/session", record.map_session);
  io.unless(std::string(), "/camera", record.camera);
  io.unless(std::string(), "/odometry", record.odometry);
  io.unless(std::string(), "/odometry_doubt", record.odometry_doubt);
  if (record.correction) transfer_correction(io, *record.correction);
  io.unless(std::string(), "/truth", record.truth);
  io.unless(1, "/truth_every", record.truth_every, 1);
  if (record.results) transfer_results(io, record, *record.results);
  if (record.score) transfer_evaluation(io, "/score", *record.score);
}

}  // namespace

std::string to_json(const RunRecord& record) {
  Json json;
  JsonWriter writer(json);
  transfer(writer, record);
  // A path need not be UTF-8, which JSON is.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

RunRecord run_record_from_json(const std::string& json, const std::string& file) {
  const Json parsed = Json::parse(json, nullptr, false);
  const JsonReader reader(parsed, file);
  if (!parsed.is_object()) reader.fail("is not a JSON object");
  for (const char* needed : {"loopbit", "options"}) {
    if (!parsed.contains(needed)) reader.fail(fmt::format("has no '{}'", needed));
  }
  RunRecord record;
  if (reader.find("/counts")) record.results.emplace();
  if (reader.find("/correction")) record.correction.emplace();
  if (reader.find("/score")) record.score.emplace();
  transfer(reader, record);
  return record;
}

int Correction::kept() const { return by_verdict[static_cast<std::size_t>(LoopVerdict::kept)]; }

int Correction::rejected() const {
  return std::accumulate(by_verdict.begin(), by_verdict.end(), -kept());
}

double total_ms(const StepTimes& times) {
  return times.content_ms + times.retrieval_ms + times.features_ms + times.verification_ms;
}

TimeSummary summarize(const std::vector<Detection>& detections,
                      const std::function<double(const StepTimes&)>& time_ms) {
  std::vector<double> times;
  for (const Detection& detection : detections) {
    if (detection.status != Status::unreadable) times.push_back(time_ms(detection.times));
  }
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  double sum = 0;
  for (const double time : times) sum += time;
  const auto quantile = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(times.size()));  // from 1
    return times[static_cast<std::size_t>(rank) - 1];
  };
  return {sum / static_cast<double>(times.size()), quantile(0.5), quantile(0.99), times.back()};
}

}  // namespace loopbit
