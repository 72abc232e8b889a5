// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

namespace loopbit::datasets {

/// Throws Error (kind input) unless each frame of the whole sequence has one of the `poses` that
/// the file at `path` tells by time, which the frames read, every so-many-th, do not have.
void check_pose_each(const std::string& path, std::size_t poses, std::size_t frames_read,
                     int every);

/// Throws Error (kind input) where `rows` of the file at `path`, one a frame of the whole sequence,
/// end before the last of the frames read, every so-many-th. `things`: what rows are.
void check_rows(const std::string& path, std::size_t rows, const char* things,
                std::size_t frames_read, int every);

}  // namespace loopbit::datasets
