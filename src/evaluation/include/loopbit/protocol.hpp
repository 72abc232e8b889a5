// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "loopbit/evaluation.hpp"
#include "loopbit/truth_file.hpp"

namespace loopbit {

/// A way of scoring that others have published with: its name fixes every setting, so that numbers
/// can be set beside theirs. Numbers of different protocols must not be mixed.
struct Protocol {
  std::string_view name;
  std::string_view help;  ///< one line
  TruthKind truth_kind;   ///< what it is defined on
  TruthOptions truth;     ///< all but `variable`
  int tolerance_frames;

  [[nodiscard]] EvaluationOptions evaluation() const {
    return {.tolerance_frames = tolerance_frames, .protocol = std::string(name)};
  }
};

/// All of them; docs/evaluation.md tells what each counts.
[[nodiscard]] std::span<const Protocol> protocols();

/// Throws Error (kind option) that lists the names if there is none such.
[[nodiscard]] const Protocol& find_protocol(const std::string& name);

}  // namespace loopbit
