// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace loopbit {

/// Writes `bytes` to `path`, all of them or nothing: a full disk leaves what was there before.
/// Throws Error (kind output).
void write_file(const std::string& path, std::string_view bytes);

}  // namespace loopbit
