// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "byte_reader.hpp"

namespace loopbit::recordings {

/// The bytes of a regular file, read where they are asked for.
class RecordFile {
 public:
  /// Throws Error (kind input) if there is no such file, or it cannot be read.
  explicit RecordFile(const std::filesystem::path& path);

  /// `count` bytes from `at` on; fewer where the file ends. Valid until the next call.
  Bytes read(std::uint64_t at, std::size_t count);

  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// How many bytes there are from `at` on.
  [[nodiscard]] std::uint64_t left(std::uint64_t at) const { return at < size_ ? size_ - at : 0; }

 private:
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;  ///< of the stream; a seek would drop what it has read ahead
  std::vector<unsigned char> buffer_;
};

}  // namespace loopbit::recordings
