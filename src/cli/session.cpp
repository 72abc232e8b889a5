// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "loopbit/error.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/mcap_export.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/run_input.hpp"
#include "loopbit/write_file.hpp"

#include "commands.hpp"
#include "json_lines.hpp"
#include "map_output.hpp"
#include "process.hpp"
#include "progress.hpp"
#include "run_list.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFramesReadAhead = 8;

/// No more than there are cores that this process may use: TBB warns of more.
int thread_count(int wanted) {
  const int cores = cv::getNumberOfCPUs();
  return wanted > 0 ? std::min(wanted, cores) : cores;
}

/// Throws Error if the folder of --mcap-out is not there and is not the run's own: a run may be
/// long.
void check_mcap_out(const SessionFlags& flags) {
  if (flags.mcap_out.empty()) return;
  const fs::path file = fs::absolute(flags.mcap_out).lexically_normal();
  std::error_code error;
  if (fs::is_directory(file, error)) throw cannot_write(flags.mcap_out, EISDIR);
  const fs::path of_run =
      fs::absolute(fs::path(flags.run.folder) / file.filename()).lexically_normal();
  const bool is_in_run = file.has_filename() && file == of_run;
  if (is_in_run || fs::is_directory(file.parent_path(), error)) return;
  throw cannot_write(flags.mcap_out, ENOENT);
}

/// Of --live, which needs no port, so that an input after it would be taken for one.
CLI::Validator port() {
  const auto check = [](std::string& text) {
    const std::string fault = whole_number(0, 65535)(text);
    return fault.empty() ? fault : fault + "; write INPUT before --live";
  };
  return {check, ""};
}

/// Null without --live.
std::unique_ptr<LivePage> open_live_page(const SessionFlags& flags) {
  if (!flags.live_port) return nullptr;
  auto page = std::make_unique<LivePage>(
      LivePage::Options{.address = flags.live_address, .port = *flags.live_port});
  tell(fmt::format("loopbit: live page: {}\n", page->url()));
  return page;
}

/// `live` may be null.
RunOutcome run_with_progress(RunInput& input, const SessionFlags& flags, LivePage* live,
                             const std::atomic<bool>& stop) {
  Progress progress(input.size(), {.shown = !flags.quiet});
  JsonLines lines;
  const RunListener listener{
      .on_detection =
          [&](const Detection& detection) {
            progress.advance(detection.status == Status::loop);
            if (flags.json) lines.add(detection);
          },
      .on_bad_frame = [&](const std::string& sentence) { progress.report(sentence); },
      .on_rejected =
          [&](const std::vector<LateLoop>& loops) {
            if (flags.json) lines.withdraw(loops);
          },
      .on_notice = [&](const std::string& sentence) { progress.note(sentence); }};
  return record_run(input, flags.run, live ? live->beside(listener) : listener, stop);
}

/// Whether the map's server was always there, and has everything.
void tell_of_server(const RunRecord& record) {
  if (record.map_unverified > 0) {
    tell(fmt::format("loopbit: Left out: {}, whose features a server did not give in time.\n",
                     counted(record.map_unverified, "candidate")));
  }
  const std::string own = addresses_in(record.map_path).front();
  if (!record.map_queue.empty()) {
    tell(fmt::format(
        "loopbit: The server of '{0}' lacks {1} of session {2}, queued in '{3}'; "
        "'loopbit map merge {0} {3}' brings them there.\n",
        own, counted(record.map_queued_frames, "frame"), record.map_session, record.map_queue));
  } else if (record.map_reconnections > 0) {
    tell(
        fmt::format("loopbit: The server of '{}' was lost and reached again {}; all frames are "
                    "saved.\n",
                    own, counted(record.map_reconnections, "time")));
  }
}

/// Leaves out a camera that was found and is not the one of `frames`, and says so.
void drop_other_camera(RunRequest& request, RunInput& frames) {
  const cv::Size size_px = frames.prove().image.size();
  try {
    check_size(*request.camera, fmt::format("'{}'", request.camera_file), size_px);
  } catch (const Error& error) {
    tell(fmt::format("loopbit: No relative poses: {}\n", error.what()));
    request.camera.reset();
  }
}

}  // namespace

void SessionFlags::add_to(CLI::App& command) {
  command.add_flag("--overwrite", run.overwrite, "Replace an earlier run in the output folder");
  command
      .add_option("--map", run.map,
                  "Continue this map file, or create it, or continue the map at a PostgreSQL "
                  "address, postgresql://... Places of earlier sessions are recognised. Of several "
                  "addresses in quotes, the first one gets the session")
      ->type_name("MAP");
  command.add_flag("--keep-images", run.keep_images, "Store a small JPEG of each place in the map")
      ->needs("--map");
  add_map_cache_flag(command, run.map_cache_mb);
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
      .add_option(
          "--threads", threads,
          "Threads, at most one per core; 0 (default) = one per core. Results do not depend on it")
      ->type_name("N")
      ->check(whole_number(0, 1024));
  CLI::Option* left_out = command.add_flag_callback(
      "--no-report", [this] { run.evidence = false; },
      "Store no pictures and write no report.html");
  command.add_flag("--open", open, "Open the report in the browser")->excludes(left_out);
  command
      .add_option(
          "--mcap-out", mcap_out,
          "Also write the loops as an MCAP file for Foxglove or Lichtblick: scene, pictures of "
          "each pair, scores and times")
      ->type_name("FILE");
  CLI::Option* live =
      command
          .add_option(
              "--live", live_port,
              fmt::format("Serve the report at http://127.0.0.1:PORT/ while the run goes on; "
                          "default: {}, 0 = any free port",
                          kLivePort))
          ->type_name("[PORT]")
          ->expected(0, 1)
          ->default_str(std::to_string(kLivePort))
          ->check(port())
          ->excludes(left_out);
  command
      .add_option(
          "--live-address", live_address,
          "Serve the report to other machines, too, on this address and at a URL with a secret "
          "token; 0.0.0.0 = all addresses")
      ->type_name("ADDRESS")
      ->needs(live);
  add_report_flag(command, report);
  command.add_flag("--json", json,
                   "Print one JSON object per loop, one per line, as soon as it is found, and a "
                   "summary as the last line");
  command.add_flag("--quiet", quiet, "Print no progress and no summary; errors are still printed");
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

void add_mask_flag(CLI::App& command, std::string& mask) {
  command
      .add_option("--mask", mask,
                  "An 8-bit image as large as the images: where it is 0 (black), the images are "
                  "ignored, such as over the robot's own body")
      ->type_name("FILE");
}

void add_image_flag(CLI::App& command, int& max_megapixels) {
  command.add_option("--max-megapixels", max_megapixels, "Larger images are unreadable")
      ->type_name("N")
      ->capture_default_str()
      ->check(whole_number(1, 1'000'000));
}

void add_topic_flag(CLI::App& command, std::string& topic) {
  command
      .add_option("--topic", topic,
                  "The topic of a recording to read; needed if several have images. 'loopbit "
                  "topics' lists them")
      ->type_name("NAME");
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

int run_session(std::unique_ptr<ImageSource> source, const std::string& input,
                const Sampling& sampling, SessionFlags flags) {
  RunRequest& request = flags.run;
  const std::atomic<bool>& stop = stop_on_signal();
  request.options = flags.detector_options();
  request.threads = thread_count(flags.threads);
  request.other_inputs = {flags.config};
  cv::setNumThreads(request.threads);
  if (request.threads > 1) source = prefetch(std::move(source), kFramesReadAhead);
  RunInput frames(std::move(source), input, sampling);
  if (flags.found_camera) drop_other_camera(request, frames);
  check_mcap_out(flags);
  const std::unique_ptr<LivePage> live = open_live_page(flags);
  const RunOutcome outcome = run_with_progress(frames, flags, live.get(), stop);
  if (!outcome.record.early_end.empty()) {
    tell(fmt::format("loopbit: {}\n", outcome.record.early_end));
  }
  tell_of_server(outcome.record);
  warn_of_damage(outcome.record.map_path, outcome.map_damage);
  const std::string report = request.evidence ? report_in(outcome.folder) : "";
  if (!report.empty()) write_report(report, {report_run(outcome.folder)}, flags.report);
  if (live) live->finish(report);
  if (!flags.mcap_out.empty()) write_mcap(flags.mcap_out, read_run(outcome.folder));
  if (flags.json) {
    JsonLines::finish(outcome, report);
  } else if (!flags.quiet) {
    print_summary(outcome, report);
  }
  const bool is_cut_off = outcome.record.stopped_by != "end";
  if (outcome.fault && !is_cut_off) throw Error(*outcome.fault);
  if (outcome.fault) tell(fmt::format("loopbit: {}\n", outcome.fault->what()));
  if (flags.open && !is_cut_off) open_page(report);
  return is_cut_off ? interrupted : success;
}

}  // namespace loopbit::cli
