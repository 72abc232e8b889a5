// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/image_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/error.hpp"

#include "encoded_image.hpp"

namespace loopbit::images {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxImageBytes = std::uintmax_t{512} << 20U;

constexpr std::array<std::string_view, 10> kExtensions = {
    ".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".pnm", ".tif", ".tiff", ".webp"};

[[noreturn]] void fail(const std::string& thing, const std::string& what) {
  throw Error(ErrorKind::input, fmt::format("{} {}.", thing, what));
}

std::string image_thing(const fs::path& file) { return fmt::format("Image '{}'", file.string()); }

/// Only regular files: reading from a pipe would block.
std::size_t checked_size(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) {
    fail(image_thing(file),
         fmt::format("cannot be found ({}): restore it, or name another file", error.message()));
  }
  if (!fs::is_regular_file(status)) {
    fail(image_thing(file), "is a folder, a pipe or a device: name an image file");
  }
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) fail(image_thing(file), fmt::format("has no readable size: {}", error.message()));
  if (size == 0) fail(image_thing(file), "is empty (0 bytes): copy it again");
  if (size > kMaxImageBytes) {
    fail(image_thing(file),
         fmt::format("has {} bytes, but at most {} are read: scale it down", size, kMaxImageBytes));
  }
  return static_cast<std::size_t>(size);
}

std::vector<unsigned char> read_bytes(const fs::path& file) {
  std::vector<unsigned char> bytes(checked_size(file));
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream.is_open() || stream.bad()) {
    fail(image_thing(file), fmt::format("cannot be read ({}): check its permissions and the disk",
                                        std::generic_category().message(errno)));
  }
  bytes.resize(static_cast<std::size_t>(stream.gcount()));  // another program may have cut it
  return bytes;
}

/// Everything the decoders throw becomes a sentence: cv::Exception at a huge declared size, or
/// std::bad_alloc.
cv::Mat decode(const std::vector<unsigned char>& bytes, const std::string& thing) {
  constexpr int kAsStored =
      cv::IMREAD_ANYDEPTH | cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION;
  try {
    return cv::imdecode(bytes, kAsStored);
  } catch (const cv::Exception& e) {
    fail(thing, fmt::format("cannot be decoded (OpenCV: {}): convert or scale it", e.err));
  } catch (const std::exception& e) {
    fail(thing, fmt::format("cannot be decoded ({}): convert or scale it", e.what()));
  }
}

}  // namespace

cv::Mat read_image_file(const fs::path& file, int max_megapixels) {
  return decode_image(read_bytes(file), max_megapixels, image_thing(file));
}

cv::Mat decode_image(const std::vector<unsigned char>& bytes, int max_megapixels,
                     const std::string& thing) {
  if (is_cut_off(bytes)) {
    fail(thing, fmt::format("is cut off after {} bytes: copy it again", bytes.size()));
  }
  const auto size = declared_size(bytes);
  if (size) check_pixel_count(size->width, size->height, max_megapixels, thing);
  cv::Mat image = size ? decode(bytes, thing) : cv::Mat();
  if (image.empty()) {
    fail(thing, "is damaged or not an image: copy it again, or convert it to PNG or JPEG");
  }
  check_pixel_format(image, thing);
  return image;
}

void check_max_megapixels(int max_megapixels) {
  if (max_megapixels >= 1) return;
  throw Error(ErrorKind::option,
              fmt::format("max_megapixels is {}, but must be at least 1.", max_megapixels));
}

void check_pixel_count(std::int64_t width, std::int64_t height, int max_megapixels,
                       const std::string& thing) {
  constexpr double kMegapixel = 1e6;
  if (static_cast<double>(width) * static_cast<double>(height) <= max_megapixels * kMegapixel) {
    return;
  }
  fail(thing, fmt::format("has {} x {} pixels, but max_megapixels is {}: scale it down, or raise "
                          "the limit",
                          width, height, max_megapixels));
}

void check_pixel_format(const cv::Mat& image, const std::string& thing) {
  const int channels = image.channels();
  const bool channels_fit = channels == 1 || channels == 3 || channels == 4;
  const bool depth_fits = image.depth() == CV_8U || image.depth() == CV_16U;
  if (channels_fit && depth_fits) return;
  fail(thing, fmt::format("has pixels of type {}: convert it to 8- or 16-bit grey or colour",
                          cv::typeToString(image.type())));
}

bool is_image_name(const fs::path& name) {
  return std::ranges::find(kExtensions, lower_extension(name)) != kExtensions.end();
}

std::string image_extensions() { return fmt::format("{}", fmt::join(kExtensions, " ")); }

std::string lower_extension(const fs::path& name) {
  std::string extension = name.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return extension;
}

}  // namespace loopbit::images
