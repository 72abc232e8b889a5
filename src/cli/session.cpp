// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "loopbit/error.hpp"
#include "loopbit/evaluation.hpp"
#include "loopbit/run_folder.hpp"
#include "loopbit/runner.hpp"

#include "commands.hpp"
#include "progress.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

constexpr std::size_t kFramesReadAhead = 8;

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

/// The first signal asks for an end in order; a second one ends the process.
extern "C" void request_stop(int signal) {
  stop_requested = true;
  std::signal(signal, SIG_DFL);
}

void install_signal_handlers() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  // Past a file size limit, let write() fail, which is reported as any full disk is.
  std::signal(SIGXFSZ, SIG_IGN);
}

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

void drive(ImageSource& source, LoopDetector& detector, RunFolder& folder) {
  Progress progress(source.size());
  const RunListener listener{[&](const Detection& detection) {
                               folder.add(detection);
                               progress.advance(detection.status == Status::loop);
                             },
                             [&](const std::string& sentence) { progress.report(sentence); }};
  run(source, detector, listener, stop_requested);
}

}  // namespace

void SessionFlags::add_to(CLI::App& command) {
  command.add_flag("--overwrite", overwrite, "Replace an earlier run in the output folder");
  command.add_option("--config", config, "Settings file, JSON; see 'loopbit options --json'")
      ->type_name("FILE");
  command
      .add_option("--set", settings, "One setting, such as surf.max_keypoints=500; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command.add_option("--threads", threads, "Threads; 0 = one a core. Changes no result")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
}

LoopDetectorOptions SessionFlags::detector_options() const {
  LoopDetectorOptions options = config.empty() ? LoopDetectorOptions{} : load_options(config);
  for (const std::string& setting : settings) {
    const auto [name, value] = split_setting(setting);
    set_option(options, name, value);
  }
  validate(options);
  return options;
}

int run_session(Session session, const SessionFlags& flags) {
  using Clock = std::chrono::steady_clock;
  install_signal_handlers();
  RunRecord record{.input = session.input,
                   .description = session.source->description(),
                   .options = flags.detector_options(),
                   .every = session.every,
                   .limit = session.limit,
                   .threads = thread_count(flags.threads)};
  // Before the folder: what refuses the run may not cost an earlier one.
  LoopDetector detector(record.options);
  RunFolder folder(flags.out, flags.overwrite);
  cv::setNumThreads(record.threads);
  if (record.threads > 1) session.source = prefetch(std::move(session.source), kFramesReadAhead);

  const auto start = Clock::now();
  const auto finish = [&](const std::string& stopped_by) {
    record.stopped_by = stopped_by;
    record.wall_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (session.truth) record.score = count_decisions(folder.detections(), *session.truth);
    folder.finish(record);
  };
  try {
    drive(*session.source, detector, folder);
    if (!stop_requested) check_readable(folder.detections(), session.input);
  } catch (const Error& error) {
    try {
      finish(error.what());
    } catch (const Error&) {  // the disk that failed the run fails its record, too
    }
    throw;
  }
  finish(stop_requested ? "interrupt" : "end");
  print_summary(record, folder);
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
