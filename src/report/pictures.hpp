// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "loopbit/evidence_file.hpp"

namespace loopbit::report {

/// The verdict of a frame; web/src/report_data.ts lists the names.
struct FrameView {
  int frame = 0;
  std::string verdict;
  std::vector<int> partners;  ///< frames shown beside it: its match, a true place
};

/// Pictures by frame number, as many as fit into `max_bytes` of JSON. Verdicts take turns; within a
/// verdict frames are spread evenly over the run. A frame comes together with its partners.
nlohmann::ordered_json pictures(const std::vector<FrameView>& frames,
                                const EvidenceReader& evidence, std::size_t max_bytes);

}  // namespace loopbit::report
