// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "encoded_image.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <string_view>

namespace loopbit::images {
namespace {

using Bytes = std::span<const unsigned char>;

constexpr std::array<unsigned char, 2> kJpegStart = {0xFF, 0xD8};
constexpr std::array<unsigned char, 8> kPngStart = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::array<unsigned char, 4> kPngEnd = {'I', 'E', 'N', 'D'};
constexpr unsigned char kJpegEnd = 0xD9;

bool starts_with(Bytes bytes, Bytes start) {
  return bytes.size() >= start.size() && std::ranges::equal(bytes.first(start.size()), start);
}

bool holds(Bytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() &&
         std::ranges::equal(bytes.subspan(at, text.size()), text, {}, {},
                            [](char c) { return static_cast<unsigned char>(c); });
}

std::size_t big_endian(Bytes bytes) {
  std::size_t value = 0;
  for (const unsigned char byte : bytes) value = value << 8U | byte;
  return value;
}

std::int64_t little_endian(Bytes bytes) {
  std::int64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8U | bytes[i];
  return value;
}

/// FF 00 is a data byte, FF FF is filling, and restart markers are part of the scan.
bool is_jpeg_marker(unsigned char code) {
  return code != 0x00 && code != 0xFF && (code < 0xD0 || code > 0xD7);
}

/// SOI and TEM are the markers without a segment, besides EOI and the restart markers.
bool has_jpeg_segment(unsigned char code) { return code != 0xD8 && code != 0x01; }

/// Where the code of the next marker stands; passes over the coded data of a scan.
std::optional<std::size_t> find_jpeg_marker(Bytes bytes, std::size_t from) {
  for (std::size_t i = from; i + 1 < bytes.size(); ++i) {
    if (bytes[i] == 0xFF && is_jpeg_marker(bytes[i + 1])) return i + 1;
  }
  return std::nullopt;
}

/// Segments are passed over by their length, so that the end of a thumbnail inside one is not
/// taken for the end of the image.
bool has_jpeg_end(Bytes bytes) {
  std::size_t at = kJpegStart.size();
  while (const auto marker = find_jpeg_marker(bytes, at)) {
    const unsigned char code = bytes[*marker];
    if (code == kJpegEnd) return true;
    at = *marker + 1;
    if (!has_jpeg_segment(code)) continue;
    if (bytes.size() - at < 2) return false;
    at += big_endian(bytes.subspan(at, 2));
  }
  return false;
}

/// The frame header gives the size: SOF0 to SOF15 without DHT, JPG and DAC, which stand among them.
std::optional<DeclaredSize> jpeg_size(Bytes bytes) {
  std::size_t at = kJpegStart.size();
  while (const auto marker = find_jpeg_marker(bytes, at)) {
    const unsigned char code = bytes[*marker];
    at = *marker + 1;
    if (!has_jpeg_segment(code)) continue;
    constexpr std::size_t kFrameHeader = 7;  // length, precision, height, width
    if (bytes.size() - at < kFrameHeader) break;
    if (code >= 0xC0 && code <= 0xCF && code != 0xC4 && code != 0xC8 && code != 0xCC) {
      return DeclaredSize{static_cast<std::int64_t>(big_endian(bytes.subspan(at + 5, 2))),
                          static_cast<std::int64_t>(big_endian(bytes.subspan(at + 3, 2)))};
    }
    at += big_endian(bytes.subspan(at, 2));
  }
  return std::nullopt;
}

/// A chunk is its length (4 bytes), type (4), data and checksum (4). The decoder checks the sums.
bool has_png_end(Bytes bytes) {
  constexpr std::size_t kFrame = 12;
  std::size_t at = kPngStart.size();
  while (bytes.size() - at >= kFrame) {
    const std::size_t length = big_endian(bytes.subspan(at, 4));
    if (length > bytes.size() - at - kFrame) return false;
    if (std::ranges::equal(bytes.subspan(at + 4, 4), kPngEnd)) return true;
    at += kFrame + length;
  }
  return false;
}

std::optional<DeclaredSize> png_size(Bytes bytes) {
  if (bytes.size() < 24) return std::nullopt;
  return DeclaredSize{static_cast<std::int64_t>(big_endian(bytes.subspan(16, 4))),
                      static_cast<std::int64_t>(big_endian(bytes.subspan(20, 4)))};
}

/// Of OS/2 (header of 12 bytes) or of Windows, where the height of rows from top to bottom is
/// negative.
std::optional<DeclaredSize> bmp_size(Bytes bytes) {
  if (bytes.size() < 26) return std::nullopt;
  constexpr std::int64_t kOs2Header = 12;
  if (little_endian(bytes.subspan(14, 4)) == kOs2Header) {
    return DeclaredSize{little_endian(bytes.subspan(18, 2)), little_endian(bytes.subspan(20, 2))};
  }
  const auto number = [&](std::size_t at) {
    return std::abs(std::int64_t{static_cast<std::int32_t>(little_endian(bytes.subspan(at, 4)))});
  };
  return DeclaredSize{number(18), number(22)};
}

/// The number after white space and comments, in decimal digits; moves `at` behind it.
std::optional<std::int64_t> pnm_number(Bytes bytes, std::size_t& at) {
  constexpr std::string_view kSpace = " \t\n\v\f\r";
  constexpr std::int64_t kMax = 1'000'000'000;
  bool in_comment = false;
  for (; at < bytes.size(); ++at) {
    const char c = static_cast<char>(bytes[at]);
    if (c == '\n' || c == '\r') in_comment = false;
    if (c == '#') in_comment = true;
    if (!in_comment && kSpace.find(c) == std::string_view::npos) break;
  }
  std::int64_t number = 0;
  const std::size_t begin = at;
  for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9' && number < kMax; ++at) {
    number = number * 10 + (bytes[at] - '0');
  }
  return at == begin ? std::nullopt : std::optional(number);
}

std::optional<DeclaredSize> pnm_size(Bytes bytes) {
  std::size_t at = 2;
  const auto width = pnm_number(bytes, at);
  const auto height = pnm_number(bytes, at);
  if (!width || !height) return std::nullopt;
  return DeclaredSize{*width, *height};
}

/// Of the first image: its directory has entries of tag (2 bytes), type (2), count (4) and value.
/// The first entry of a tag counts.
std::optional<DeclaredSize> tiff_size(Bytes bytes) {
  const bool is_big = bytes[0] == 'M';
  const auto number = [&](std::size_t at, std::size_t size) -> std::int64_t {
    if (at + size > bytes.size()) return -1;
    const Bytes field = bytes.subspan(at, size);
    return is_big ? static_cast<std::int64_t>(big_endian(field)) : little_endian(field);
  };
  const std::int64_t directory = number(4, 4);
  if (directory < 0) return std::nullopt;
  const auto value_of = [&](std::int64_t tag) -> std::int64_t {
    const auto begin = static_cast<std::size_t>(directory);
    const std::int64_t entries = number(begin, 2);
    for (std::int64_t i = 0; i < entries; ++i) {
      const std::size_t at = begin + 2 + 12 * static_cast<std::size_t>(i);
      if (number(at, 2) != tag) continue;
      const std::int64_t type = number(at + 2, 2);
      return type == 3 ? number(at + 8, 2) : type == 4 ? number(at + 8, 4) : -1;
    }
    return -1;
  };
  constexpr int kWidth = 256;
  constexpr int kHeight = 257;
  const DeclaredSize size{value_of(kWidth), value_of(kHeight)};
  return size.width < 0 || size.height < 0 ? std::nullopt : std::optional(size);
}

/// In the first chunk: lossy, lossless or extended.
std::optional<DeclaredSize> webp_size(Bytes bytes) {
  constexpr std::int64_t k14Bits = 0x3FFF;
  if (bytes.size() < 30) return std::nullopt;
  if (holds(bytes, 12, "VP8 ")) {
    return DeclaredSize{little_endian(bytes.subspan(26, 2)) & k14Bits,
                        little_endian(bytes.subspan(28, 2)) & k14Bits};
  }
  if (holds(bytes, 12, "VP8L")) {
    const std::int64_t sizes = little_endian(bytes.subspan(21, 4));
    return DeclaredSize{(sizes & k14Bits) + 1, (sizes >> 14U & k14Bits) + 1};
  }
  if (!holds(bytes, 12, "VP8X")) return std::nullopt;
  return DeclaredSize{little_endian(bytes.subspan(24, 3)) + 1,
                      little_endian(bytes.subspan(27, 3)) + 1};
}

}  // namespace

bool is_cut_off(std::span<const unsigned char> encoded) {
  if (starts_with(encoded, kJpegStart)) return !has_jpeg_end(encoded);
  if (starts_with(encoded, kPngStart)) return !has_png_end(encoded);
  return false;
}

std::optional<DeclaredSize> declared_size(std::span<const unsigned char> encoded) {
  using namespace std::string_view_literals;
  if (starts_with(encoded, kJpegStart)) return jpeg_size(encoded);
  if (starts_with(encoded, kPngStart)) return png_size(encoded);
  if (holds(encoded, 0, "BM")) return bmp_size(encoded);
  if (holds(encoded, 0, "II*\0"sv) || holds(encoded, 0, "MM\0*"sv)) return tiff_size(encoded);
  if (holds(encoded, 0, "RIFF") && holds(encoded, 8, "WEBP")) return webp_size(encoded);
  const bool is_pnm =
      encoded.size() > 2 && encoded[0] == 'P' && encoded[1] >= '1' && encoded[1] <= '6';
  return is_pnm ? pnm_size(encoded) : std::nullopt;
}

}  // namespace loopbit::images
