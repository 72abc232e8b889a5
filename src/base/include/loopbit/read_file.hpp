// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

namespace loopbit {

/// The most that is read of a file of text: a loop matrix of 20,000 frames and millions of poses
/// fit, and the memory of a usual computer holds what is made of them.
inline constexpr std::uintmax_t kMaxTextBytes = std::uintmax_t{1} << 30U;

/// All bytes of `path`. Throws Error (kind input) where it cannot be read, has more than
/// `max_bytes`, or is not a regular file: reading a pipe may wait for ever, and a device may never
/// end.
std::string read_file(const std::string& path, std::uintmax_t max_bytes = kMaxTextBytes);

/// As read_file(). Throws Error (kind input) where the file is not text: it holds a NUL byte.
std::string read_text(const std::string& path, std::uintmax_t max_bytes = kMaxTextBytes);

}  // namespace loopbit
