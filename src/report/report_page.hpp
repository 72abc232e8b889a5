// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace loopbit::report {

/// report.html, with a place for its data.
extern const std::string_view kPage;

}  // namespace loopbit::report
