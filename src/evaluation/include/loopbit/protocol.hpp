// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "loopbit/evaluation.hpp"
#include "loopbit/truth_file.hpp"

namespace loopbit {

/// A published scoring protocol. Its name fixes every setting, so that numbers can be compared with
/// published ones. Numbers of different protocols must not be mixed.
struct Protocol {
  std::string_view name;
  std::string_view help;  ///< one line
  TruthKind truth_kind;   ///< kind of truth that it requires
  TruthOptions truth;     ///< all but `variable`
  int tolerance_frames;

  [[nodiscard]] EvaluationOptions evaluation() const {
    return {.tolerance_frames = tolerance_frames, .protocol = std::string(name)};
  }
};

/// All protocols; docs/evaluation.md describes them.
[[nodiscard]] std::span<const Protocol> protocols();

/// Throws Error (kind option) that lists the known names if `name` is not one of them.
[[nodiscard]] const Protocol& find_protocol(const std::string& name);

}  // namespace loopbit
