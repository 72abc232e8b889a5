// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/loop_graph.hpp"

namespace loopbit {

/// Writes a graph in g2o's text format: VERTEX_SE3:QUAT for each keyframe, EDGE_SE3:QUAT for
/// odometry and kept loops. Other programs read it as it is. A comment before each loop has the
/// verdict and what is known. Loops that are not kept are comments, and a loop without a length has
/// no information about the translation, so that other programs ignore what they do not know.
/// Throws Error (kind output).
void write_g2o(const std::string& path, const LoopGraph& graph);

/// Reads a graph as write_g2o() or another program wrote it: vertices are numbered from 0 without
/// gaps; the first edge from a vertex to the next one is odometry, and all others are loops. What
/// write_g2o() wrote is read back identically: writing it again gives the same bytes. The loops of
/// other programs are undecided. Throws Error (kind input), with file and line.
LoopGraph read_g2o(const std::string& path, const LoopGraphOptions& options = {});

}  // namespace loopbit
