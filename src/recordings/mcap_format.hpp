// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include <zlib.h>

#include "byte_reader.hpp"

// The MCAP format, version 0: https://mcap.dev/spec
namespace loopbit::recordings {

inline constexpr std::array<unsigned char, 8> kMcapMagic = {0x89, 'M', 'C',  'A',
                                                            'P',  '0', '\r', '\n'};

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

inline std::uint32_t checksum(Bytes bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
}

}  // namespace loopbit::recordings
