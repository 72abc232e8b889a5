// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/run_record.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string_view>
#include <thread>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/utsname.h>

#include "loopbit/error.hpp"
#include "loopbit/instruction_set.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

/// Writes values to JSON. The place of a value is like "/input/every".
class Writer {
 public:
  explicit Writer(Json& json) : json_(json) {}

  template <typename Value>
  void operator()(const std::string& place, const Value& value, double /*min*/ = 0,
                  double /*max*/ = 0) {
    json_[Json::json_pointer(place)] = value;
  }

  /// Leaves out the usual value.
  template <typename Value>
  void unless(const Value& usual, const std::string& place, const Value& value,
              double /*min*/ = 0) {
    if (value != usual) (*this)(place, value);
  }

 private:
  Json& json_;
};

/// Reads values from JSON. Those that are missing or null stay as they are.
class Reader {
 public:
  static constexpr double kMax = std::numeric_limits<int>::max();

  Reader(const Json& json, const std::string& file) : json_(json), file_(file) {}

  template <typename Value>
  void operator()(const std::string& place, Value& value, double min = 0, double max = kMax) const {
    const Json* found = find(place);
    if (!found) return;
    if (!is_a<Value>(*found)) fail(place, *found);
    if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>) {
      const auto number = found->template get<double>();
      if (number < min || number > max) fail(place, *found);
    }
    value = found->template get<Value>();
  }

  template <typename Value>
  void unless(const Value& /*usual*/, const std::string& place, Value& value,
              double min = 0) const {
    (*this)(place, value, min);
  }

  /// What is at `place`; null if nothing is. Throws Error if something above it is no object.
  [[nodiscard]] const Json* find(const std::string& place) const {
    const Json* found = &json_;
    for (std::size_t begin = 0; begin < place.size();) {
      if (!found->is_object()) fail(place.substr(0, begin), *found);
      const std::size_t end = std::min(place.find('/', begin + 1), place.size());
      const auto child = found->find(place.substr(begin + 1, end - begin - 1));
      if (child == found->end() || child->is_null()) return nullptr;
      found = &*child;
      begin = end;
    }
    return found;
  }

  [[noreturn]] void fail(std::string_view fault) const {
    throw Error(ErrorKind::input,
                fmt::format("'{}' {}: it is no record of a run, or was changed after loopbit wrote "
                            "it; run again, or delete the file to go on without it.",
                            file_, fault));
  }

 private:
  [[noreturn]] void fail(std::string place, const Json& value) const {
    std::replace(place.begin(), place.end(), '/', '.');
    // A dump would recurse into what is nested, however deep.
    const std::string text =
        value.is_structured()
            ? fmt::format("an {}", value.type_name())
            : value.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 40);
    fail(
        fmt::format("has {} for '{}'", text, place.substr(std::min<std::size_t>(1, place.size()))));
  }

  template <typename Value>
  static bool is_a(const Json& json) {
    if constexpr (std::is_same_v<Value, bool>) {
      return json.is_boolean();
    } else if constexpr (std::is_integral_v<Value>) {
      return json.is_number_integer();
    } else if constexpr (std::is_arithmetic_v<Value>) {
      return json.is_number();
    } else if constexpr (std::is_same_v<Value, std::string>) {
      return json.is_string();
    } else {  // a list of strings
      return json.is_array() && std::all_of(json.begin(), json.end(),
                                            [](const Json& item) { return item.is_string(); });
    }
  }

  const Json& json_;
  const std::string& file_;
};

// The fields of run.json, in order. `io` is a Writer or a Reader.

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
  transfer_times(io, "/times_ms/content", results.content_ms);
  transfer_times(io, "/times_ms/retrieval", results.retrieval_ms);
  transfer_times(io, "/times_ms/features", results.features_ms);
  transfer_times(io, "/times_ms/verification", results.verification_ms);
  transfer_times(io, "/times_ms/total", results.total_ms);
  io("/wall_s", record.wall_s);
  io("/frames_per_s", results.frames_per_s);
  io("/peak_memory_mib", results.peak_memory_mib);
}

template <typename Io, typename Record>
void transfer(Io& io, Record& record) {
  io("/loopbit", record.version);
  io("/arguments", record.arguments);
  io("/input/path", record.input);
  io("/input/description", record.description);
  io("/input/every", record.every, 1);
  io("/input/limit", record.limit);
  io.unless(std::string(), "/input/early_end", record.early_end);
  io.unless(1, "/input/views", record.views, 1);
  io("/stopped_by", record.stopped_by);
  transfer_options(io, record.options);
  io("/machine/processor", record.machine.processor);
  io("/machine/cores", record.machine.cores);
  io("/machine/kernel", record.machine.kernel);
  io("/machine/system", record.machine.system);
  io("/threads", record.threads);
  io.unless(std::string(), "/map/path", record.map_path);
  io.unless(0, "/map/session", record.map_session);
  io.unless(std::string(), "/truth", record.truth);
  io.unless(1, "/truth_every", record.truth_every, 1);
  if (record.results) transfer_results(io, record, *record.results);
}

/// to_json(Evaluation) writes these values.
void read_score(const Reader& read, Evaluation& score) {
  read("/score/protocol", score.options.protocol);
  read("/score/tolerance_frames", score.options.tolerance_frames);
  read("/score/positives", score.decision.positives);
  read("/score/right", score.decision.right);
  read("/score/tolerated", score.decision.tolerated);
  read("/score/wrong", score.decision.wrong);
  read("/score/ignored", score.decision.ignored);
  read("/score/pairs/positives", score.pairs.positives);
  read("/score/pairs/found", score.pairs.found);
  read("/score/pairs/right", score.pairs.right);
  read("/score/pairs/wrong", score.pairs.wrong);
  read("/score/recall_at_full_precision", score.recall_at_full_precision);
  read("/score/average_precision", score.average_precision);
  if (read.find("/score/score_at_full_precision")) {
    read("/score/score_at_full_precision", score.score_at_full_precision.emplace());
  }
}

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

double peak_memory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr double kKibPerMib = 1024.0;
  return static_cast<double>(usage.ru_maxrss) / kKibPerMib;
}

}  // namespace

std::string to_json(const RunRecord& record) {
  Json json;
  Writer writer(json);
  transfer(writer, record);
  if (record.score) json["score"] = Json::parse(to_json(*record.score, false));
  // A path need not be UTF-8, which JSON is.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

RunRecord run_record_from_json(const std::string& json, const std::string& file) {
  const Json parsed = Json::parse(json, nullptr, false);
  const Reader reader(parsed, file);
  if (!parsed.is_object()) reader.fail("is not a JSON object");
  for (const char* needed : {"loopbit", "options"}) {
    if (!parsed.contains(needed)) reader.fail(fmt::format("has no '{}'", needed));
  }
  RunRecord record;
  if (reader.find("/counts")) record.results.emplace();
  transfer(reader, record);
  if (reader.find("/score")) read_score(reader, record.score.emplace());
  return record;
}

Machine this_machine() {
  utsname system{};
  uname(&system);
  return {.processor = processor_name(),
          .cores = static_cast<int>(std::thread::hardware_concurrency()),
          .kernel = std::string(to_string(active_instruction_set())),
          .system = fmt::format("{} {} {}", system.sysname, system.release, system.machine)};
}

RunResults run_results(const std::vector<Detection>& detections, double wall_s) {
  RunResults results{.frames = static_cast<int>(detections.size()),
                     .content_ms = summarize(detections, &StepTimes::content_ms),
                     .retrieval_ms = summarize(detections, &StepTimes::retrieval_ms),
                     .features_ms = summarize(detections, &StepTimes::features_ms),
                     .verification_ms = summarize(detections, &StepTimes::verification_ms),
                     .total_ms = summarize(detections, loopbit::total_ms),
                     .peak_memory_mib = peak_memory_mib()};
  for (const Detection& d : detections) ++results.by_status[static_cast<std::size_t>(d.status)];
  if (wall_s > 0) results.frames_per_s = static_cast<double>(detections.size()) / wall_s;
  return results;
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
