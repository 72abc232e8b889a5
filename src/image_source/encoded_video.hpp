// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace loopbit::images {

/// How many bytes `file` has when it is whole, by the sizes that its container gives; none where
/// they do not say, and for all but AVI, MP4, QuickTime, Matroska and WebM. Decoders take the end
/// of a file for the end of its video.
std::optional<std::uint64_t> declared_bytes(const std::filesystem::path& file);

}  // namespace loopbit::images
