// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace loopbit::cli {

/// Opens a file in the user's browser with xdg-open. Throws Error (kind output) if that fails.
void open_page(const std::string& path);

}  // namespace loopbit::cli
