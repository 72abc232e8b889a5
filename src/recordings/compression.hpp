// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "byte_reader.hpp"

namespace loopbit::recordings {

enum class Compression : std::uint8_t { none, lz4, zstd, bz2 };

/// "" and "none" are none; "lz4" is its frame format. Nothing for another name.
std::optional<Compression> compression_of(std::string_view name);

/// Replaces `out` by what `compressed` holds, and returns true if that is whole and has `size`
/// bytes. Of damaged or cut bytes, `out` is what comes before the damage. Memory grows with what is
/// really there, so a wrong `size` does no harm.
bool decompress(Compression compression, Bytes compressed, std::size_t size,
                std::vector<unsigned char>& out);

/// True of a zstd frame, as rosbag2 stores messages it compresses one by one. No CDR message begins
/// with these bytes.
bool is_zstd(Bytes bytes);

/// As decompress(), of a zstd frame that holds up to `max_size` bytes.
bool decompress_zstd(Bytes compressed, std::size_t max_size, std::vector<unsigned char>& out);

/// The bytes as a zstd frame.
std::vector<unsigned char> compress_zstd(Bytes bytes);

}  // namespace loopbit::recordings
