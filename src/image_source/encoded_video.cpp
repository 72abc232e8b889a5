// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "encoded_video.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <limits>
#include <string_view>

namespace loopbit::images {
namespace {

using Size = std::optional<std::uint64_t>;

/// No file is as long. Keeps sums of two sizes in range.
constexpr std::uint64_t kMaxSize = std::uint64_t{1} << 62U;

/// Parts of a file, wherever they are.
class Parts {
 public:
  explicit Parts(const std::filesystem::path& file) : stream_(file, std::ios::binary) {}

  /// Of `bytes` at `at`, or nothing where the file ends before.
  [[nodiscard]] std::optional<std::string_view> text(std::uint64_t at, std::size_t bytes) {
    if (at > kMaxSize) return std::nullopt;
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(at));
    stream_.read(buffer_.data(), static_cast<std::streamsize>(bytes));
    return stream_ ? std::optional(std::string_view(buffer_.data(), bytes)) : std::nullopt;
  }

 private:
  std::ifstream stream_;
  std::array<char, 16> buffer_{};
};

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) {
    value = value << 8U | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

/// A RIFF chunk, and more of them after it where the video is over 1 GB. While it is recorded, the
/// size is 0 or the largest number.
Size avi_bytes(Parts& parts) {
  constexpr std::uint64_t kHeader = 8;  // which some writers count as part of the size
  std::uint64_t end = 0;
  for (std::uint64_t at = 0;;) {
    const auto head = parts.text(at, kHeader + 4);
    if (!head || !head->starts_with("RIFF") || !head->substr(kHeader).starts_with("AVI")) break;
    const std::uint64_t size = little_endian(head->substr(4, 4));
    if (size <= kHeader || size == std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
    end = at + size;
    at += kHeader + size + size % 2;
  }
  return end == 0 ? std::nullopt : Size(end);
}

/// Boxes one after the other. A size of 1 stands before a long one, and 0 goes to the end of the
/// file. Others than those of pictures and their index may be missing.
Size mp4_bytes(Parts& parts) {
  constexpr int kMaxBoxes = 1'000'000;
  constexpr std::array<std::string_view, 3> kNeeded = {"mdat", "moov", "moof"};
  std::uint64_t needed = 0;
  std::uint64_t at = 0;
  for (int boxes = 0; boxes < kMaxBoxes; ++boxes) {
    const auto head = parts.text(at, 8);
    if (!head) break;
    const bool is_needed = std::ranges::find(kNeeded, head->substr(4)) != kNeeded.end();
    std::uint64_t size = big_endian(head->substr(0, 4));
    if (size == 1) {
      const auto long_size = parts.text(at + 8, 8);
      if (!long_size) break;
      size = big_endian(*long_size);
    }
    if (size < 8 || size > kMaxSize) break;
    at += size;
    if (is_needed) needed = at;
  }
  return needed == 0 ? std::nullopt : Size(needed);
}

/// How many bytes a number has whose first byte is `first`: one more than that has leading zeros.
std::size_t ebml_length(char first) {
  return static_cast<std::size_t>(std::countl_zero(static_cast<unsigned char>(first))) + 1;
}

/// A header, then one segment. A segment that is recorded or sent has a size of ones only.
Size matroska_bytes(Parts& parts) {
  constexpr std::string_view kSegment = "\x18\x53\x80\x67";
  std::uint64_t at = 0;
  for (int elements = 0; elements < 2; ++elements) {
    const auto id = parts.text(at, kSegment.size());
    if (!id) return std::nullopt;
    const bool is_segment = *id == kSegment;
    at += kSegment.size();
    const auto first = parts.text(at, 1);
    if (!first || ebml_length(first->front()) > 8) return std::nullopt;
    const std::size_t length = ebml_length(first->front());
    const auto bytes = parts.text(at, length);
    if (!bytes) return std::nullopt;
    const std::uint64_t unknown = (std::uint64_t{1} << 7U * length) - 1;
    const std::uint64_t size = big_endian(*bytes) & unknown;
    if (size == unknown || size > kMaxSize) return std::nullopt;
    at += length + size;
    if (is_segment) return at;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::uint64_t> declared_bytes(const std::filesystem::path& file) {
  Parts parts(file);
  const auto head = parts.text(0, 12);
  if (!head) return std::nullopt;
  if (head->starts_with("RIFF")) return avi_bytes(parts);
  if (head->starts_with("\x1A\x45\xDF\xA3")) return matroska_bytes(parts);
  constexpr std::array<std::string_view, 6> kFirstBoxes = {"ftyp", "moov", "mdat",
                                                           "wide", "free", "skip"};
  const bool is_mp4 = std::ranges::find(kFirstBoxes, head->substr(4, 4)) != kFirstBoxes.end();
  return is_mp4 ? mp4_bytes(parts) : std::nullopt;
}

}  // namespace loopbit::images
