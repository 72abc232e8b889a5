// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "loopbit/map_file.hpp"

namespace loopbit {

/// What there is in a map, and what of it is damaged.
struct MapCheck {
  std::int64_t sessions = 0;
  std::int64_t places = 0;  ///< whole, with their features
  std::int64_t loops = 0;
  std::int64_t images = 0;               ///< whole
  std::vector<std::string> damage = {};  ///< a clause a thing; empty if all is well
};

/// Reads every byte of a map. Throws Error (kind input) as MapReader does.
MapCheck check_map(const std::string& path);

struct MergeCounts {
  std::int64_t sessions = 0;  ///< copied
  std::int64_t places = 0;    ///< copied
  std::int64_t loops = 0;     ///< copied
  std::int64_t known = 0;     ///< sessions that were there before, told by their uid
};

/// Adds to the map `into`, made if there is none, the sessions of `from` that it lacks, with their
/// places and loops; all of them or nothing. Throws Error: kind output if `into` has a writer or
/// cannot be written; option if the two were made with different settings; input if `from` is
/// damaged or being written.
MergeCounts merge_map(const std::string& into, const std::string& from);

/// Copies what is whole of a damaged map to a new one, under the same numbers. A session whose
/// description is lost is called "recovered". A map that version 1 began loses its images with its
/// first page. Throws Error: kind output if `to` exists or cannot be written, input if there is
/// nothing to copy or `from` is of a newer version. What fails leaves no file.
MapCheck recover_map(const std::string& from, const std::string& to);

struct CompactOptions {
  std::vector<int> drop_sessions;  ///< with their places and loops
  std::int64_t max_places = 0;     ///< the least missed are removed beyond that; 0 = none
  bool drop_images = false;        ///< all of them; places stay
};

struct CompactCounts {
  std::int64_t places_before = 0;
  std::int64_t places_after = 0;
  std::uintmax_t bytes_before = 0;
  std::uintmax_t bytes_after = 0;
};

/// Forgets sessions, redundant places and images, and gives their space back. The new file replaces
/// the old one in one step, so that no crash leaves half of it; it needs room for both. Throws
/// Error: kind option for a session that is not there; output if the map is read or written by
/// others, or cannot be written; input if it is damaged.
CompactCounts compact_map(const std::string& path, const CompactOptions& options);

enum class ExportFormat { csv, json, g2o };

/// The loops of a map as edges of a graph; docs/format.md describes the formats. Frames are
/// numbered through all sessions, in order of session.
std::string export_loops(MapReader& map, ExportFormat format);

}  // namespace loopbit
