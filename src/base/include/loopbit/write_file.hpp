// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace loopbit {

/// Writes `bytes` to `path`, all of them or nothing: a full disk leaves what was there before. A
/// link stays one, and what is no regular file, such as a device or a pipe, is written as it is.
/// Throws Error (kind output).
void write_file(const std::string& path, std::string_view bytes);

/// The file that `path` names, through all symbolic links, whether it is there or not; `path`
/// itself where the system does not say.
std::string resolved_path(const std::string& path);

}  // namespace loopbit
