// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/report.hpp"

namespace loopbit {

/// The JSON in the page; web/src/report_data.ts describes its fields.
std::string report_json(const std::vector<ReportRun>& runs, const ReportOptions& options = {});

}  // namespace loopbit
