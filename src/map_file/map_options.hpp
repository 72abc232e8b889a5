// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/loop_detector_options.hpp"

namespace loopbit {

// Of a detector's settings, those of binary content and SURF shape what a map holds: places made
// with other ones cannot be compared. All others may change from session to session.

/// Throws Error (kind option) that names the first setting that differs between `json`, the
/// options of a session of the map at `path`, and `options`, and what to do.
void check_same_shape(const std::string& path, const std::string& json,
                      const LoopDetectorOptions& options);

/// Throws Error (kind option) that names the first such setting in which a `detector` differs from
/// `made_with`, those of the map at `path`.
void check_detector(const std::string& path, const LoopDetectorOptions& made_with,
                    const LoopDetectorOptions& detector);

/// The defaults, with those settings of `json` that shape places. Throws Error (kind input) if it
/// has none, or such as this version does not know.
LoopDetectorOptions options_of_shape(const std::string& path, const std::string& json);

}  // namespace loopbit
