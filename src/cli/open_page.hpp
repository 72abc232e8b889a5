// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace loopbit::cli {

/// Shows a file in the user's browser, by xdg-open. Throws Error (kind output) if that fails.
void open_page(const std::string& path);

}  // namespace loopbit::cli
