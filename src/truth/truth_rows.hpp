// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/ground_truth.hpp"

namespace loopbit::truth {

// Numbers in a row of poses, by which a file's format is told.
inline constexpr std::size_t kTumColumns = 8;
inline constexpr std::size_t kKittiColumns = 12;
inline constexpr std::size_t kEurocColumns = 17;
inline constexpr std::size_t kCovarianceColumns = 29;

/// Whether any of the frames has a time.
bool has_times(const FramesRead& frames);

/// Throws Error (kind input) unless each frame of the whole sequence has one of the `poses` that
/// the file at `path` tells by time, which the frames read do not have.
void check_pose_each(const std::string& path, std::size_t poses, const FramesRead& frames);

/// Throws Error (kind input) where `rows` of the file at `path`, one a frame of the whole sequence,
/// end before the last of the frames read, or go on where the sequence has ended. `things`: what
/// rows are.
void check_rows(const std::string& path, std::size_t rows, const char* things,
                const FramesRead& frames);

/// Throws Error (kind input) where the file at `path` tells of `frame`, which the sequence does not
/// have.
void check_frame(const std::string& path, int frame, const FramesRead& frames);

/// What `make` makes of the file at `path`, which its errors of the kind input name.
template <typename Make>
auto made_of_file(const std::string& path, const Make& make) {
  try {
    return make();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::input) throw;
    throw Error(error.kind(), fmt::format("'{}': {}", path, error.what()));
  }
}

/// Adds `places` to `runs`; lengthens the last run if it can.
inline void add_places(std::vector<PlaceRun>& runs, const PlaceRun& places) {
  if (!runs.empty() && runs.back().query == places.query && runs.back().last + 1 == places.first) {
    runs.back().last = places.last;
  } else {
    runs.push_back(places);
  }
}

}  // namespace loopbit::truth
