// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "loopbit/error.hpp"

namespace loopbit {

/// Writes `bytes` to `path`, completely or not at all: if the disk is full, the old file remains.
/// Symbolic links are kept, and devices and pipes are written directly. Throws Error (kind output).
void write_file(const std::string& path, std::string_view bytes);

/// Makes a folder for files. Throws Error (kind output) if it cannot, or if there are files in it.
void make_new_folder(const std::string& folder);

/// Resolves all symbolic links of `path`, whether the file exists or not. Returns `path` if the
/// system cannot resolve it.
std::string resolved_path(const std::string& path);

/// The Error (kind output) for a file or folder that cannot be written. Its message has the name,
/// the reason of `errno_value`, the remedy, and what is `kept`, if not empty.
Error cannot_write(const std::string& path, int errno_value, const std::string& kept = "");

}  // namespace loopbit
