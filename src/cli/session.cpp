// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "loopbit/error.hpp"
#include "loopbit/evaluation.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/picture_jpeg.hpp"
#include "loopbit/run_folder.hpp"
#include "loopbit/runner.hpp"

#include "commands.hpp"
#include "progress.hpp"
#include "run_list.hpp"
#include "stop_signal.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

constexpr std::size_t kFramesReadAhead = 8;

int thread_count(int wanted) {
  return wanted > 0 ? wanted : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void check_readable(const std::vector<Detection>& detections, const std::string& input) {
  const bool none = std::all_of(detections.begin(), detections.end(),
                                [](const Detection& d) { return d.status == Status::unreadable; });
  if (none) {
    throw Error(ErrorKind::input,
                fmt::format("None of the {} frames of '{}' could be read; see the "
                            "messages above.",
                            detections.size(), input));
  }
}

void drive(ImageSource& source, LoopDetector& detector, RunFolder& folder, bool keep_evidence,
           const std::atomic<bool>& stop) {
  Progress progress(source.size());
  RunListener listener{[&](const Detection& detection) {
                         folder.add(detection);
                         progress.advance(detection.status == Status::loop);
                       },
                       [&](const std::string& sentence) { progress.report(sentence); }};
  std::optional<EvidenceWriter> evidence;
  if (keep_evidence) {
    evidence.emplace(folder.evidence_path());
    listener.on_evidence = [&](const Detection& detection, const cv::Mat& image,
                               const Evidence& seen) {
      evidence->add(detection.frame, image, seen);
    };
  }
  run(source, detector, listener, stop);
  if (evidence) evidence->finish();
}

/// Where a run is kept whose user named a map only: "town.db" and session 2 give "town_session_2".
std::string folder_beside(const std::string& map, int session) {
  const auto stem = std::filesystem::path(map).replace_extension().string();
  return fmt::format("{}_session_{}", stem, session);
}

/// Scores the run in `folder` into `record`, and keeps what it was scored by.
void score(const Session& session, RunFolder& folder, RunRecord& record) {
  const MatchList list = match_list(folder.detections());
  if (const auto positions = session.positions(list.times_s); !positions.empty()) {
    folder.write_positions(positions);
  }
  const auto truth = session.truth(list.times_s);
  if (!truth) return;
  folder.write_truth(*truth);
  record.score = evaluate(list, *truth, session.evaluation);
}

}  // namespace

void SessionFlags::add_to(CLI::App& command) {
  command.add_flag("--overwrite", overwrite, "Replace an earlier run in the output folder");
  command
      .add_option("--map", map,
                  "Continue this map, made if there is none: earlier sessions' places are "
                  "recognised, too")
      ->type_name("MAP.db");
  command.add_flag("--keep-images", keep_images, "Keep a small JPEG of each place in the map")
      ->needs("--map");
  CLI::Option* named =
      command.add_option("--preset", preset, "Named settings to begin with: default or paper")
          ->type_name("NAME");
  command.add_option("--config", config, "Settings file, JSON; see 'loopbit options --json'")
      ->type_name("FILE")
      ->excludes(named);
  command
      .add_option("--set", settings, "One setting, such as surf.max_keypoints=500; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command.add_option("--threads", threads, "Threads; 0 = one a core. Changes no result")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command.add_flag("--no-report", no_report, "Keep no pictures and write no report.html");
  add_report_flag(command, report);
}

void add_report_flag(CLI::App& command, ReportOptions& options) {
  command
      .add_option("--pictures-mb", options.max_pictures_mb,
                  "Pictures in the report take at most so many megabytes")
      ->type_name("MB")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 2000.0));
}

LoopDetectorOptions SessionFlags::detector_options() const {
  LoopDetectorOptions options = config.empty() ? loopbit::preset(preset) : load_options(config);
  for (const std::string& setting : settings) {
    const auto [name, value] = split_setting(setting);
    set_option(options, name, value);
  }
  validate(options);
  return options;
}

int run_session(Session session, const SessionFlags& flags) {
  using Clock = std::chrono::steady_clock;
  const std::atomic<bool>& stop_requested = stop_on_signal();
  RunRecord record{.input = session.input,
                   .description = session.source->description(),
                   .options = flags.detector_options(),
                   .every = session.every,
                   .limit = session.limit,
                   .threads = thread_count(flags.threads)};
  // Before the folder: what refuses the run may not cost an earlier one.
  std::shared_ptr<MapWriter> map;
  if (!flags.map.empty()) {
    map = std::make_shared<MapWriter>(flags.map, record.options, session.input,
                                      flags.keep_images ? picture_jpeg : EncodeImage{});
    record.map_path = flags.map;
    record.map_session = map->session();
  }
  LoopDetector detector(record.options, map);
  RunFolder folder(flags.out.empty() ? folder_beside(flags.map, record.map_session) : flags.out,
                   flags.overwrite);
  cv::setNumThreads(record.threads);
  if (record.threads > 1) session.source = prefetch(std::move(session.source), kFramesReadAhead);

  const auto start = Clock::now();
  const auto finish = [&](const std::string& stopped_by) {
    record.stopped_by = stopped_by;
    folder.finish(record);
  };
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  try {
    drive(*session.source, detector, folder, !flags.no_report, stop_requested);
    if (map) map->finish();
    record.wall_s = elapsed_s();
    if (!stop_requested) check_readable(folder.detections(), session.input);
    score(session, folder, record);
  } catch (const Error& error) {
    record.wall_s = elapsed_s();
    try {
      finish(error.what());
    } catch (const Error&) {  // the disk that failed the run fails its record, too
    }
    throw;
  }
  finish(stop_requested ? "interrupt" : "end");
  if (!flags.no_report)
    write_report(folder.report_path(), {report_run(folder.path())}, flags.report);
  print_summary(record, folder, !flags.no_report);
  return stop_requested ? interrupted : success;
}

std::pair<std::string, std::string> split_setting(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) {
    throw Error(ErrorKind::option,
                fmt::format("The setting '{}' has no value; write NAME=VALUE.", text));
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace loopbit::cli
