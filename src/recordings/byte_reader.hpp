// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace loopbit::recordings {

using Bytes = std::span<const unsigned char>;

/// Reads values from bytes, one after another. Where the bytes end before a value does, this value
/// and all later ones are 0 or empty, and ok() is false.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes, std::endian order = std::endian::little)
      : bytes_(bytes), order_(order) {}

  template <std::unsigned_integral Number>
  Number number() {
    Number value = 0;
    const Bytes from = bytes(sizeof(Number));
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::size_t at = order_ == std::endian::little ? from.size() - 1 - i : i;
      value = static_cast<Number>(static_cast<std::uint64_t>(value) << 8U | from[at]);
    }
    return value;
  }

  Bytes bytes(std::uint64_t count) {
    if (count > left()) ok_ = false;
    if (!ok_) return {};
    const Bytes taken = bytes_.subspan(at_, static_cast<std::size_t>(count));
    at_ += taken.size();
    return taken;
  }

  /// Bytes after their number, which is 4 bytes long.
  Bytes counted_bytes() { return bytes(number<std::uint32_t>()); }

  /// A text after its length, which is 4 bytes long.
  std::string text() {
    const Bytes characters = counted_bytes();
    return {characters.begin(), characters.end()};
  }

  /// Goes on at the next multiple of `size` bytes from the first.
  void align(std::size_t size) { bytes((size - at_ % size) % size); }

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  Bytes bytes_;
  std::endian order_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace loopbit::recordings
