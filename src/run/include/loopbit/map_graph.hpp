// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/map_file.hpp"
#include "loopbit/run_record.hpp"

namespace loopbit {

/// What a pose graph makes of a map.
struct MapCorrection {
  struct Session {
    int session = 0;
    int keyframes = 0;  ///< frames with odometry
    /// The first session that kept loops join it to, directly or through others, and in whose
    /// frame its corrected poses are: itself, if there is none before. 0 without odometry.
    int frame_of = 0;
  };

  Correction correction;
  std::vector<Session> sessions;
  std::vector<MapLoop> rejected;  ///< by query
};

/// Solves the pose graph of all sessions of a map: their odometry, and the loops within and between
/// them, with the relative poses that were measured. The map is not changed; reject_loops() does
/// that.
///
/// `folder`: if not empty, it is made, and trajectory.csv, judged_loops.csv, graph.g2o and, for
/// each session with odometry, corrected_SESSION.tum are written there; see docs/run_folder.md.
/// Throws Error: kind input if no frame has odometry, output if the folder has files or a file
/// cannot be written.
MapCorrection correct_map(MapReader& map, const std::string& folder = {});

}  // namespace loopbit
