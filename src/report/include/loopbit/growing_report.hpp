// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/detection.hpp"
#include "loopbit/evidence_file.hpp"

namespace loopbit {

// The report page of a run that goes on. It is served by the part `live`.

/// The page before the first frame. It reads the frames from the server that it came from; see
/// web/src/live.ts. `id`: of the run, so that the page notices when its server shows another one.
std::string growing_report(const std::string& name, const std::string& record_json,
                           const std::string& id);

/// The columns of these frames, as the page appends them to those it has: JSON in one line.
std::string report_columns(const std::vector<Detection>& detections);

/// The picture of a frame: JSON in one line.
std::string report_picture(const StoredEvidence& evidence);

}  // namespace loopbit
