// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "mat_layout.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <zlib.h>

namespace loopbit::truth {
namespace {

namespace fs = std::filesystem;

// "MAT-File Format", The MathWorks, chapter 1: a header of 128 bytes that ends in the version and
// the byte order, then elements, each with a tag of its type and length.
constexpr std::size_t kHeaderBytes = 128;
constexpr std::size_t kVersionAt = 124;
constexpr std::size_t kOrderAt = 126;
constexpr std::size_t kTagBytes = 8;
constexpr std::uint32_t kMatrix = 14;
constexpr std::uint32_t kCompressed = 15;

std::uint32_t read_number(const std::byte* bytes, std::size_t count, bool little) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = little ? count - 1 - i : i;
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[at]);
  }
  return number;
}

template <std::size_t size>
bool read(std::ifstream& stream, std::array<std::byte, size>& bytes) {
  stream.read(reinterpret_cast<char*>(bytes.data()), size);
  return stream.good();
}

/// What follows the tag of a matrix: its flags, and the tag of its dimensions.
constexpr std::size_t kMatrixStartBytes = 24;
using MatrixStart = std::array<std::byte, kMatrixStartBytes>;

/// libmatio takes memory for as many dimensions as a file says, up to 8 GB.
bool has_sane_dimensions(const MatrixStart& start, bool little) {
  // Strings, tables and other objects of MATLAB's have none, and are passed over.
  constexpr std::uint32_t kOpaque = 17;
  if ((read_number(start.data() + 8, 4, little) & 0xFFU) == kOpaque) return true;
  constexpr std::uint32_t kInt32 = 5;
  constexpr std::uint32_t kMaxDimensions = 32;
  const std::uint32_t type = read_number(start.data() + 16, 4, little);
  const std::uint32_t bytes = read_number(start.data() + 20, 4, little);
  return type == kInt32 && bytes >= 8 && bytes <= 4 * kMaxDimensions;
}

/// The first bytes that `stream` unpacks to, without the tag of the matrix; false where there are
/// not so many.
bool unpack(std::ifstream& stream, std::uint32_t packed_bytes, MatrixStart& start) {
  std::array<char, 512> packed{};
  stream.read(packed.data(), std::min<std::streamsize>(packed_bytes, packed.size()));
  std::array<std::byte, kTagBytes + kMatrixStartBytes> unpacked{};
  z_stream zlib{};
  if (inflateInit(&zlib) != Z_OK) return false;
  zlib.next_in = reinterpret_cast<Bytef*>(packed.data());
  zlib.avail_in = static_cast<uInt>(stream.gcount());
  zlib.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  zlib.avail_out = static_cast<uInt>(unpacked.size());
  inflate(&zlib, Z_SYNC_FLUSH);
  inflateEnd(&zlib);
  std::copy(unpacked.begin() + kTagBytes, unpacked.end(), start.begin());
  return zlib.avail_out == 0;
}

/// Of the element whose tag was just read. An empty matrix has nothing to be wrong.
bool is_sane_matrix(std::ifstream& stream, std::uint32_t type, std::uint32_t bytes, bool little) {
  if (bytes == 0) return true;
  MatrixStart start{};
  const bool is_read = type == kCompressed ? unpack(stream, bytes, start) : read(stream, start);
  return is_read && has_sane_dimensions(start, little);
}

/// Walks over the variables from the end of the header to `file_bytes`.
std::string fault_of_elements(std::ifstream& stream, std::uintmax_t file_bytes, bool little) {
  std::uintmax_t at = kHeaderBytes;
  while (at < file_bytes) {
    std::array<std::byte, kTagBytes> tag{};
    stream.seekg(static_cast<std::streamoff>(at));
    if (file_bytes - at < kTagBytes || !read(stream, tag)) {
      return fmt::format("is cut off after {} bytes: copy it again", file_bytes);
    }
    const std::uint32_t type = read_number(tag.data(), 4, little);
    const std::uint32_t bytes = read_number(tag.data() + 4, 4, little);
    if (type != kMatrix && type != kCompressed) {
      return fmt::format("is damaged at byte {}: copy it again, or save it anew", at);
    }
    at += kTagBytes;
    if (bytes > file_bytes - at) {
      return fmt::format("is cut off after {} bytes: copy it again", file_bytes);
    }
    if (!is_sane_matrix(stream, type, bytes, little)) {
      return fmt::format("is damaged at byte {}: copy it again, or save it anew", at);
    }
    at += bytes;
  }
  return "";
}

}  // namespace

std::string fault_of_mat_file(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return "cannot be found: correct the path";
  const std::uintmax_t bytes = fs::file_size(path, error);
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) {
    return fmt::format("cannot be read ({}): check its permissions",
                       std::generic_category().message(errno));
  }
  std::array<std::byte, kHeaderBytes> header{};
  if (!read(stream, header)) return fmt::format("is cut off after {} bytes: copy it again", bytes);
  const std::uint32_t order = read_number(header.data() + kOrderAt, 2, false);
  const bool little = order == 0x494D;  // "IM"
  const bool big = order == 0x4D49;
  const std::uint32_t version = read_number(header.data() + kVersionAt, 2, little);
  if ((little || big) && version == 0x0200) return "";
  if ((little || big) && version == 0x0100) return fault_of_elements(stream, bytes, little);
  return "is not of MATLAB's format 5 to 7.3: save it anew, in MATLAB with the option -v7";
}

}  // namespace loopbit::truth
