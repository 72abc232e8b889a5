// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "loopbit/finished_run.hpp"

namespace loopbit::report {

/// The relative poses of a run by query, as web/src/report_data.ts describes them; null if it has
/// none. A query has its last one. The frames in `pictures` also get epipolar lines, from the
/// inliers in their pictures, if the camera is known.
nlohmann::ordered_json loop_poses(const FinishedRun& run, const nlohmann::ordered_json& pictures);

}  // namespace loopbit::report
