// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "loopbit/error.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/provable_source.hpp"
#include "loopbit/recorded_run.hpp"

#include "commands.hpp"
#include "map_output.hpp"
#include "process.hpp"
#include "progress.hpp"
#include "run_list.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

constexpr std::size_t kFramesReadAhead = 8;

/// No more than there are cores that this process may use: TBB warns of more.
int thread_count(int wanted) {
  const int cores = cv::getNumberOfCPUs();
  return wanted > 0 ? std::min(wanted, cores) : cores;
}

void drive(ImageSource& source, RecordedRun& recorded, bool keep_evidence,
           const std::atomic<bool>& stop) {
  {
    Progress progress(source.size());
    const RunListener listener{
        [&](const Detection& detection) { progress.advance(detection.status == Status::loop); },
        [&](const std::string& sentence) { progress.report(sentence); }};
    recorded.detect(source, listener, keep_evidence, stop);
  }
  const std::string& why = recorded.record().early_end;
  if (!why.empty()) tell(fmt::format("loopbit: {}\n", why));
}

/// Returns what went wrong: the run itself is none the worse for it.
std::optional<Error> score(const Session& session, RecordedRun& recorded) {
  const FrameTimes times_s = match_list(recorded.folder().detections()).times_s;
  std::optional<Error> fault;
  const auto attempt = [&](const auto& step) {
    try {
      step();
    } catch (const Error& error) {
      if (!fault) fault = error;
    }
  };
  attempt([&] {
    const auto [truth, evaluation] = session.scoring(times_s);
    if (truth) recorded.score(*truth, evaluation);
  });
  attempt([&] {
    const auto positions = session.positions(times_s);
    if (!positions.empty()) recorded.keep_positions(positions);
  });
  return fault;
}

void present(const RecordedRun& recorded, const SessionFlags& flags) {
  const RunFolder& folder = recorded.folder();
  if (!flags.no_report) {
    write_report(folder.report_path(), {report_run(folder.path())}, flags.report);
  }
  print_summary(recorded.record(), folder, !flags.no_report);
}

}  // namespace

void SessionFlags::add_to(CLI::App& command) {
  command.add_flag("--overwrite", overwrite, "Replace an earlier run in the output folder");
  command
      .add_option("--map", map,
                  "Continue this map, or create it. Places of earlier sessions are recognised")
      ->type_name("MAP.db");
  command.add_flag("--keep-images", keep_images, "Store a small JPEG of each place in the map")
      ->needs("--map");
  add_map_cache_flag(command, map_cache_mb);
  CLI::Option* named = command.add_option("--preset", preset, "Initial settings: default or paper")
                           ->type_name("NAME");
  command.add_option("--config", config, "Settings file, JSON; see 'loopbit options --json'")
      ->type_name("FILE")
      ->excludes(named);
  command
      .add_option("--set", settings, "One setting, such as surf.max_keypoints=500; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command
      .add_option("--threads", threads,
                  "Threads, at most one per core; 0 = one per core. Results do not depend on it")
      ->type_name("N")
      ->check(whole_number(0, 1024));
  CLI::Option* left_out =
      command.add_flag("--no-report", no_report, "Store no pictures and write no report.html");
  command.add_flag("--open", open, "Open the report in the browser")->excludes(left_out);
  add_report_flag(command, report);
}

void add_map_cache_flag(CLI::App& command, std::size_t& cache_mb) {
  command
      .add_option("--map-cache-mb", cache_mb,
                  "Keep up to this many MiB of the map's features in memory. Changes no result")
      ->type_name("MB")
      ->capture_default_str()
      ->check(whole_number(0, 1'000'000));
}

void add_report_flag(CLI::App& command, ReportOptions& options) {
  command
      .add_option("--pictures-mb", options.max_pictures_mb,
                  "Largest total size of the pictures in the report, megabytes")
      ->type_name("MB")
      ->capture_default_str()
      ->check(number(0.0, 2000.0));
}

void add_image_flag(CLI::App& command, int& max_megapixels) {
  command.add_option("--max-megapixels", max_megapixels, "Larger images are unreadable")
      ->type_name("N")
      ->capture_default_str()
      ->check(whole_number(1, 1'000'000));
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
  const std::atomic<bool>& stop_requested = stop_on_signal();
  const int threads = thread_count(flags.threads);
  std::vector<std::string> inputs = session.truth_files;
  inputs.insert(inputs.end(), {session.input, flags.config});
  const LoopDetectorOptions options = flags.detector_options();
  if (flags.overwrite || options.exclusion.seconds > 0) {
    auto provable = std::make_unique<ProvableSource>(std::move(session.source));
    check_time(provable->prove(session.input), options);
    session.source = std::move(provable);
  }
  RecordedRun recorded({.input = session.input,
                        .description = session.source->description(),
                        .options = options,
                        .every = session.every,
                        .limit = session.limit,
                        .threads = threads,
                        .map_path = flags.map,
                        .arguments = session.arguments,
                        .truth = session.truth_description},
                       {.folder = flags.out,
                        .overwrite = flags.overwrite,
                        .keep_images = flags.keep_images,
                        .map_cache_mb = flags.map_cache_mb,
                        .inputs = inputs});
  cv::setNumThreads(threads);
  if (threads > 1) session.source = prefetch(std::move(session.source), kFramesReadAhead);
  try {
    drive(*session.source, recorded, !flags.no_report, stop_requested);
    warn_of_damage(flags.map, recorded.map_damage());
  } catch (const Error& error) {
    try {
      recorded.finish(error.what());
    } catch (const Error&) {  // the first error is the one to tell
    }
    throw;
  }
  const std::optional<Error> fault = score(session, recorded);
  recorded.finish(stop_requested ? "interrupt" : "end");
  present(recorded, flags);
  if (fault && !stop_requested) throw Error(fault->kind(), fault->what());
  if (fault) tell(fmt::format("loopbit: {}\n", fault->what()));
  if (flags.open && !stop_requested) open_page(recorded.folder().report_path());
  return stop_requested ? interrupted : success;
}

}  // namespace loopbit::cli
