// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/map_file.hpp"

namespace loopbit {

/// The content of a map and its damage.
struct MapCheck {
  std::int64_t sessions = 0;
  std::int64_t places = 0;  ///< undamaged places with their features
  std::int64_t loops = 0;
  std::int64_t images = 0;               ///< undamaged images
  std::vector<std::string> damage = {};  ///< one clause each; empty if there is none
};

/// Checks a map by reading every byte. Throws Error (kind input) as MapReader does.
MapCheck check_map(const std::string& path);

struct MergeCounts {
  std::int64_t sessions = 0;   ///< copied
  std::int64_t places = 0;     ///< copied
  std::int64_t loops = 0;      ///< copied
  std::int64_t known = 0;      ///< sessions that `into` already had, compared by uid
  std::int64_t continued = 0;  ///< sessions of which it had fewer frames; it gets the rest
};

/// Copies the sessions of `from` that `into` lacks, with their places and loops, completely or not
/// at all, and the rest of those that it has in part. Creates `into` if there is none. Throws
/// Error: kind output if `into` has a writer or cannot be written; option if the two were made with
/// different settings; input if `from` is damaged or being written.
MergeCounts merge_map(const std::string& into, const std::string& from);

struct MoveCounts {
  std::int64_t sessions = 0;  ///< moved
  std::int64_t places = 0;    ///< of them
  std::int64_t known = 0;     ///< sessions that `from` does not have, but `to` has
};

/// Moves sessions with their loops from one server to another, under their numbers. Each is copied
/// in one commit, read again and compared, and only then removed, in one commit. So a second call
/// continues after a kill; meanwhile, ShardedMap takes two copies for one. Needs the owners of both
/// maps. Throws Error: kind option if a map is a file, has no such session, or has another one of
/// its number; output if a session is being written, changes meanwhile, or a server does not take
/// part; input if a map is damaged.
MoveCounts move_sessions(const std::string& from, const std::string& to,
                         const std::vector<int>& sessions);

/// The progress of link_map(), and its result.
struct LinkCounts {
  std::int64_t sessions = 0;      ///< compared with all earlier ones
  std::int64_t places = 0;        ///< of them, processed
  std::int64_t total_places = 0;  ///< to be processed; more than `places` if it was stopped
  std::int64_t loops = 0;         ///< found and stored
};

/// Finds the loops between sessions that never met, such as those of merged maps. Each session that
/// is not `linked` is processed again, from its stored contents and features, with all earlier
/// sessions as candidates. The map gets the loops that a run on that map would have found in
/// earlier sessions, unless it has one for the frame. Loops within a session stay as they are.
///
/// `options`: none = those that each session was recorded with; of another version of loopbit only
/// those of binary_content and surf, with defaults for the rest. `progress` is called for each
/// frame; if it returns false, link_map() stops. Each session is added completely or not at all, so
/// a second call continues after a stop or a kill. If all sessions are linked, no byte changes.
/// Takes a few milliseconds per place. Throws Error: kind output if the map has a writer or cannot
/// be written, option if `options` are not valid or differ from the map's settings of
/// binary_content or surf, input if the map is damaged.
LinkCounts link_map(const std::string& path,
                    const std::optional<LoopDetectorOptions>& options = std::nullopt,
                    const std::function<bool(const LinkCounts&)>& progress = {});

/// Moves loops to those that are rejected, in one commit, as LoopDetector::reject() does: they are
/// not exported, later sessions do not use them, and link_map() does not find them again. Throws
/// Error: kind output if the map has a writer or cannot be written, input if it is damaged.
void reject_loops(const std::string& path, const std::vector<MapLoop>& loops);

/// Copies all undamaged rows of a map to a new map, under the same numbers. A session whose
/// description is lost is named "recovered". A map begun by version 1 loses its images with its
/// first page. Throws Error: kind output if `to` exists or cannot be written, input if there is
/// nothing to copy or `from` is of a newer version. No file remains after an error.
MapCheck recover_map(const std::string& from, const std::string& to);

struct CompactOptions {
  std::vector<int> drop_sessions;  ///< sessions to drop, with their places and loops
  std::int64_t max_places = 0;     ///< the most redundant are dropped above this; 0 = no limit
  bool drop_images = false;        ///< drops all images, but no places
};

struct CompactCounts {
  std::int64_t places_before = 0;
  std::int64_t places_after = 0;
  std::uintmax_t bytes_before = 0;
  std::uintmax_t bytes_after = 0;
};

/// Drops sessions, redundant places and images, and frees their space. The new file replaces the
/// old one in one step, so a crash leaves a complete map. It needs space for both files. On a
/// server, the rows are removed in one commit, and the server reuses their space; this needs the
/// owner of the map, and robots that are running keep what they know. Throws Error: kind option for
/// a session that does not exist; output if others write the map or read the file, or it cannot be
/// written; input if it is damaged.
CompactCounts compact_map(const std::string& path, const CompactOptions& options);

enum class ExportFormat { csv, json, g2o };

/// The loops of a map as text; docs/format.md describes the formats. Frames are numbered
/// consecutively through all sessions.
std::string export_loops(MapReader& map, ExportFormat format);

}  // namespace loopbit
