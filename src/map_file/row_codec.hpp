// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

// How a map's values become bytes; docs/format.md describes the same. All numbers are
// little-endian.

/// CRC-32, as zlib computes it, of values in turn.
class Checksum {
 public:
  Checksum& add(std::int64_t value);
  Checksum& add(double value);
  Checksum& add(std::span<const unsigned char> bytes);
  Checksum& add(std::string_view text);

  [[nodiscard]] std::int64_t value() const { return value_; }

 private:
  std::uint32_t value_ = 0;
};

/// 512 bytes: 64 rows of 64 bits. Valid as long as `content`.
std::span<const unsigned char> content_bytes(const BinaryContent& content);

/// False, and `content` as it was, unless there are 512 bytes.
bool read_content(std::span<const unsigned char> bytes, BinaryContent& content);

/// 16 + 80 bytes a feature.
std::vector<unsigned char> features_bytes(const Features& features);

/// Nothing unless the bytes are features within the limits that SurfOptions sets.
std::optional<Features> features_from(std::span<const unsigned char> bytes);

}  // namespace loopbit
