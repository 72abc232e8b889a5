// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "loopbit/evaluation.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/report.hpp"

#include "truth_flags.hpp"

namespace loopbit::cli {

/// The flags that every command with a detector shares.
struct SessionFlags {
  std::string out;           ///< empty = beside the map, named after it
  std::string map;           ///< empty = none
  bool keep_images = false;  ///< in the map
  std::size_t map_cache_mb = kMapCache_mb;
  bool overwrite = false;
  std::string preset = "default";
  std::string config;
  std::vector<std::string> settings;  ///< "section.field=value"
  int threads = 0;                    ///< at most one a core; 0 = as many
  bool no_report = false;
  bool open = false;  ///< the report, in the browser
  ReportOptions report;

  void add_to(CLI::App& command);

  /// The defaults, changed by the configuration file, then by single settings.
  [[nodiscard]] LoopDetectorOptions detector_options() const;
};

/// What is to be run, and what is known about it.
struct Session {
  std::unique_ptr<ImageSource> source;
  std::string input;                          ///< for run.json and the summary
  std::vector<std::string> arguments = {};    ///< of the command line, for run.json
  std::vector<std::string> truth_files = {};  ///< see TruthFlags::files
  std::string truth_description = {};         ///< what says what is true; empty = nothing does
  int every = 1;
  int limit = 0;
  // Asked with the frames' times when the run is over.
  std::function<Scoring(const FrameTimes&)> scoring;
  std::function<Positions(const FrameTimes&)> positions;
};

/// Adds the flag for ReportOptions to `command`.
void add_report_flag(CLI::App& command, ReportOptions& options);

/// Adds the flag for what of a map stays in memory.
void add_map_cache_flag(CLI::App& command, std::size_t& cache_mb);

/// Adds the flag for open_source()'s largest images to `command`.
void add_image_flag(CLI::App& command, int& max_megapixels);

/// Runs a detector over the session's images into the folder that `flags` names, with progress on
/// stderr and a summary on stdout. Returns the exit code. Interrupts (Ctrl-C) end it in order.
/// Throws Error.
int run_session(Session session, const SessionFlags& flags);

}  // namespace loopbit::cli
