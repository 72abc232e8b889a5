// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "loopbit/evaluation.hpp"

namespace loopbit::cli {

/// A run in a plot.
struct NamedEvaluation {
  std::string name;
  const Evaluation& evaluation;
};

/// The precision-recall curves of the runs as an SVG picture. A dot marks a detector's own
/// decision.
std::string curve_plot(const std::vector<NamedEvaluation>& runs);

/// Adds the flag for the file that gets the picture to `command`.
void add_plot_flag(CLI::App& command, std::string& file);

}  // namespace loopbit::cli
