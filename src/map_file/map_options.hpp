// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/loop_detector_options.hpp"

namespace loopbit {

// The settings of binary content and SURF determine a map's places: places made with different ones
// cannot be compared. All other settings may change between sessions.

/// Throws Error (kind option) that names the first such setting that differs between `json`, the
/// options of a session in the map at `path`, and `options`.
void check_same_shape(const std::string& path, const std::string& json,
                      const LoopDetectorOptions& options);

/// The same for a `detector` that uses a map whose session was opened with `made_with`.
void check_detector(const std::string& path, const LoopDetectorOptions& made_with,
                    const LoopDetectorOptions& detector);

/// The defaults, with those settings of `json` that determine places. Throws Error (kind input) if
/// `json` lacks them or has unknown ones.
LoopDetectorOptions options_of_shape(const std::string& path, const std::string& json);

}  // namespace loopbit
