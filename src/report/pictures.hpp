// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "loopbit/evidence_file.hpp"

namespace loopbit::report {

/// The verdict of a frame; web/src/report_data.ts lists the names.
struct FrameView {
  int frame = 0;
  std::string verdict;
  std::vector<int> partners = {};  ///< frames shown beside it: its match, a true place
  double loop_score = -std::numeric_limits<double>::infinity();  ///< if it is a loop of this run
};

/// The frame that the page opens on: the first wrong loop, otherwise the loop with the highest
/// score, the first missed revisit, or 0.
int first_frame(const std::vector<FrameView>& frames);

/// The picture of one frame, as the page reads it.
nlohmann::ordered_json picture(const StoredEvidence& evidence);

/// Pictures by frame number, as many as fit into `max_bytes` of JSON, a frame together with its
/// partners. First come the first_frame(), wrong loops and the weakest loops. Then verdicts take
/// turns; within a verdict frames are spread evenly over the run.
nlohmann::ordered_json pictures(const std::vector<FrameView>& frames,
                                const EvidenceReader& evidence, std::size_t max_bytes);

}  // namespace loopbit::report
