// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "loopbit/image_source.hpp"
#include "loopbit/live_page.hpp"
#include "loopbit/record_run.hpp"
#include "loopbit/report.hpp"

namespace loopbit::cli {

/// The flags that every command with a detector shares.
struct SessionFlags {
  RunRequest run;
  std::string preset = "default";
  std::string config;
  std::vector<std::string> settings;  ///< "section.field=value"
  int threads = 0;                    ///< at most one a core; 0 = as many
  bool open = false;                  ///< the report, in the browser
  bool json = false;                  ///< JSON in place of the summary
  bool quiet = false;                 ///< no progress, no summary
  ReportOptions report;
  std::string mcap_out;          ///< file; empty = none
  std::optional<int> live_port;  ///< of the live page; none = no such page
  std::string live_address = LivePage::Options{}.address;
  bool found_camera = false;  ///< run.camera was not named by the user; it may be of other images

  void add_to(CLI::App& command);

  /// The defaults, changed by the configuration file, then by single settings.
  [[nodiscard]] LoopDetectorOptions detector_options() const;
};

/// Adds the flag for ReportOptions to `command`.
void add_report_flag(CLI::App& command, ReportOptions& options);

/// Adds the flag for what of a map stays in memory.
void add_map_cache_flag(CLI::App& command, std::size_t& cache_mb);

/// Adds the flag for LoopDetector::set_mask() to `command`.
void add_mask_flag(CLI::App& command, std::string& mask);

/// Adds the flag for open_source()'s largest images to `command`.
void add_image_flag(CLI::App& command, int& max_megapixels);

/// Adds the flag for open_input()'s topic to `command`.
void add_topic_flag(CLI::App& command, std::string& topic);

/// Runs a detector over the frames of `input` that `sampling` leaves, as `flags` ask, with progress
/// on stderr and a summary or JSON on stdout. Returns the exit code. Interrupts (Ctrl-C) end it in
/// order. Throws Error.
int run_session(std::unique_ptr<ImageSource> source, const std::string& input,
                const Sampling& sampling, SessionFlags flags);

}  // namespace loopbit::cli
