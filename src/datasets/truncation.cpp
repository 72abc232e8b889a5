// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "truncation.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

namespace loopbit::datasets {
namespace {

using Bytes = std::span<const unsigned char>;

constexpr std::array<unsigned char, 2> kJpegStart = {0xFF, 0xD8};
constexpr std::array<unsigned char, 8> kPngStart = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::array<unsigned char, 4> kPngEnd = {'I', 'E', 'N', 'D'};
constexpr unsigned char kJpegEnd = 0xD9;

bool starts_with(Bytes bytes, Bytes start) {
  return bytes.size() >= start.size() && std::ranges::equal(bytes.first(start.size()), start);
}

std::size_t big_endian(Bytes bytes) {
  std::size_t value = 0;
  for (const unsigned char byte : bytes) value = value << 8U | byte;
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

}  // namespace

bool is_cut_off(std::span<const unsigned char> encoded) {
  if (starts_with(encoded, kJpegStart)) return !has_jpeg_end(encoded);
  if (starts_with(encoded, kPngStart)) return !has_png_end(encoded);
  return false;
}

}  // namespace loopbit::datasets
