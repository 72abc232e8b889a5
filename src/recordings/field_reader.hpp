// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "recording_file.hpp"

namespace loopbit::recordings {

/// Of a sensor's clock since 1970, or since it was switched on.
struct Stamp {
  std::int64_t seconds = 0;
  std::uint32_t nanoseconds = 0;

  static Stamp of(std::uint64_t time_ns) {
    return {static_cast<std::int64_t>(time_ns / kSecond_ns),
            static_cast<std::uint32_t>(time_ns % kSecond_ns)};
  }

  [[nodiscard]] bool is_set() const {
    return (seconds != 0 || nanoseconds != 0) && nanoseconds < kSecond_ns;
  }
  [[nodiscard]] std::string name() const { return fmt::format("{}.{:09}", seconds, nanoseconds); }
  [[nodiscard]] double in_seconds() const {
    return static_cast<double>(seconds) + static_cast<double>(nanoseconds) / kSecond_ns;
  }
};

/// How most messages begin, in ROS 1 and ROS 2.
struct Header {
  Stamp stamp;
  std::string frame_id;
};

/// Reads what messages consist of (CDR: OMG DDSI-RTPS 2.5, 10.5, and DDS-XTYPES 1.3, 7.4). ROS 1
/// aligns nothing; CDR aligns numbers to their size, counted from behind its first 4 bytes, and
/// ends strings with a NUL. Where the bytes end before a value does, see ByteReader.
class FieldReader {
 public:
  /// Throws Error (kind input) if a message of ROS 2 is no plain CDR; `thing` begins the sentence.
  FieldReader(const Channel& channel, Bytes message, const std::string& thing)
      : reader_(message), bytes_(message.size()) {
    if (channel.encoding == Encoding::ros1) return;
    constexpr std::size_t kHead = 4;
    // The second byte tells the order of bytes: big or little endian of CDR, then of CDR 2, which
    // aligns to 4 at most.
    constexpr std::array<unsigned, 4> kPlain = {0x00, 0x01, 0x06, 0x07};
    const bool is_plain = message.size() >= kHead && message[0] == 0 &&
                          std::ranges::find(kPlain, message[1]) != kPlain.end();
    if (!is_plain) {
      throw Error(ErrorKind::input,
                  fmt::format("{} is not encoded in plain CDR: record it again.", thing));
    }
    const auto order = (message[1] & 1U) != 0 ? std::endian::little : std::endian::big;
    reader_ = ByteReader(message.subspan(kHead), order);
    largest_alignment_ = message[1] < 0x06 ? 8 : 4;
  }

  std::uint8_t byte() { return reader_.number<std::uint8_t>(); }
  std::uint32_t number() { return aligned<std::uint32_t>(); }
  double real() { return std::bit_cast<double>(aligned<std::uint64_t>()); }
  Bytes counted_bytes() { return reader_.bytes(number()); }

  std::string text() {
    Bytes characters = counted_bytes();
    if (is_cdr() && !characters.empty()) characters = characters.first(characters.size() - 1);
    return {characters.begin(), characters.end()};
  }

  /// In ROS 1 it begins with a number, and seconds have no sign.
  Header header() {
    if (!is_cdr()) number();
    const std::uint32_t seconds = number();
    Header header;
    header.stamp.seconds = is_cdr() ? std::bit_cast<std::int32_t>(seconds) : std::int64_t{seconds};
    header.stamp.nanoseconds = number();
    header.frame_id = text();
    return header;
  }

  /// Throws Error (kind input) unless all that was read was there.
  void check_whole(const std::string& thing) const {
    if (reader_.ok()) return;
    throw Error(ErrorKind::input, fmt::format("{} is cut off after {} bytes.", thing, bytes_));
  }

 private:
  [[nodiscard]] bool is_cdr() const { return largest_alignment_ > 0; }

  template <typename Number>
  Number aligned() {
    if (is_cdr()) reader_.align(std::min(sizeof(Number), largest_alignment_));
    return reader_.number<Number>();
  }

  ByteReader reader_;
  std::size_t bytes_;
  std::size_t largest_alignment_ = 0;  ///< 0: of ROS 1, which aligns nothing
};

}  // namespace loopbit::recordings
