// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Messages: https://docs.ros2.org/latest/api/sensor_msgs; encodings:
// sensor_msgs/image_encodings.hpp.
#include "image_message.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/imgproc.hpp>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"

#include "field_reader.hpp"

namespace loopbit::recordings {
namespace {

[[noreturn]] void fail(const std::string& thing, const std::string& what) {
  throw Error(ErrorKind::input, fmt::format("{} {}.", thing, what));
}

bool is_compressed_type(std::string_view type) {
  return type == "sensor_msgs/msg/CompressedImage" || type == "sensor_msgs/CompressedImage";
}

/// What the pixels of an encoding are, and how OpenCV converts them.
struct Layout {
  std::string_view encoding;
  int type;
  int conversion = -1;  ///< -1: none
};

/// OpenCV names a Bayer pattern by its second row from the second column on.
constexpr std::array kLayouts = {
    Layout{"mono8", CV_8UC1},
    Layout{"8UC1", CV_8UC1},
    Layout{"mono16", CV_16UC1},
    Layout{"16UC1", CV_16UC1},
    Layout{"bgr8", CV_8UC3},
    Layout{"8UC3", CV_8UC3},
    Layout{"rgb8", CV_8UC3, cv::COLOR_RGB2BGR},
    Layout{"bgra8", CV_8UC4},
    Layout{"8UC4", CV_8UC4},
    Layout{"rgba8", CV_8UC4, cv::COLOR_RGBA2BGRA},
    Layout{"bgr16", CV_16UC3},
    Layout{"rgb16", CV_16UC3, cv::COLOR_RGB2BGR},
    Layout{"bgra16", CV_16UC4},
    Layout{"rgba16", CV_16UC4, cv::COLOR_RGBA2BGRA},
    Layout{"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2BGR},
    Layout{"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2BGR},
    Layout{"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2BGR},
    Layout{"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2BGR},
    Layout{"bayer_rggb16", CV_16UC1, cv::COLOR_BayerBG2BGR},
    Layout{"bayer_bggr16", CV_16UC1, cv::COLOR_BayerRG2BGR},
    Layout{"bayer_gbrg16", CV_16UC1, cv::COLOR_BayerGR2BGR},
    Layout{"bayer_grbg16", CV_16UC1, cv::COLOR_BayerGB2BGR},
    Layout{"yuv422", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
    Layout{"uyvy", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
    Layout{"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2BGR_YUY2},
    Layout{"yuyv", CV_8UC2, cv::COLOR_YUV2BGR_YUY2},
};

const Layout& layout_of(const std::string& encoding, const std::string& thing) {
  const auto* const layout = std::ranges::find(kLayouts, encoding, &Layout::encoding);
  if (layout != kLayouts.end()) return *layout;
  std::array<std::string_view, kLayouts.size()> known{};
  std::ranges::transform(kLayouts, known.begin(), &Layout::encoding);
  fail(thing, fmt::format("has the encoding '{}': record the topic in one of {}", encoding,
                          fmt::join(known, " ")));
}

/// Of yuv422, two pixels share their colour.
bool are_pairs_whole(const Layout& layout, const ImageMessage& message) {
  return CV_MAT_CN(layout.type) != 2 || message.width % 2 == 0;
}

void swap_bytes(cv::Mat& image) {
  const std::ptrdiff_t row_values = std::ptrdiff_t{image.cols} * image.channels();
  for (int y = 0; y < image.rows; ++y) {
    auto* const row = image.ptr<std::uint16_t>(y);
    std::transform(row, row + row_values, row, [](std::uint16_t value) {
      return static_cast<std::uint16_t>(value << 8U | value >> 8U);
    });
  }
}

cv::Mat raw_image(const ImageMessage& message, int max_megapixels, const std::string& thing) {
  const Layout& layout = layout_of(message.encoding, thing);
  if (message.width == 0 || message.height == 0) {
    fail(thing, fmt::format("has {} x {} pixels: leave it out", message.width, message.height));
  }
  images::check_pixel_count(message.width, message.height, max_megapixels, thing);
  const std::uint64_t row_bytes =
      std::uint64_t{message.width} * static_cast<std::uint64_t>(CV_ELEM_SIZE(layout.type));
  const std::uint64_t bytes = std::uint64_t{message.step} * (message.height - 1) + row_bytes;
  if (message.step < row_bytes || message.data.size() < bytes ||
      !are_pairs_whole(layout, message)) {
    fail(thing,
         fmt::format("declares {} x {} pixels, {}, in rows of {} bytes, which do not fit its "
                     "{} bytes: record it again",
                     message.width, message.height, message.encoding, message.step,
                     message.data.size()));
  }
  cv::Mat image(static_cast<int>(message.height), static_cast<int>(message.width), layout.type);
  for (int y = 0; y < image.rows; ++y) {
    const std::size_t begin = std::size_t{message.step} * static_cast<std::size_t>(y);
    std::ranges::copy(message.data.subspan(begin, row_bytes), image.ptr(y));
  }
  constexpr auto kOwnOrder = std::endian::native;
  if (CV_MAT_DEPTH(layout.type) == CV_16U &&
      message.is_big_endian != (kOwnOrder == std::endian::big)) {
    swap_bytes(image);
  }
  if (layout.conversion < 0) return image;
  cv::Mat converted;
  cv::cvtColor(image, converted, layout.conversion);
  return converted;
}

}  // namespace

bool is_image(const Channel& channel) {
  const bool is_type = is_compressed_type(channel.type) ||
                       channel.type == "sensor_msgs/msg/Image" ||
                       channel.type == "sensor_msgs/Image";
  return is_type && channel.encoding != Encoding::other;
}

ImageMessage read_image_message(const Channel& channel, Bytes message, const std::string& thing) {
  FieldReader fields(channel, message, thing);
  ImageMessage image;
  image.header = fields.header();
  image.is_compressed = is_compressed_type(channel.type);
  if (image.is_compressed) {
    image.encoding = fields.text();
  } else {
    image.height = fields.number();
    image.width = fields.number();
    image.encoding = fields.text();
    image.is_big_endian = fields.byte() != 0;
    image.step = fields.number();
  }
  image.data = fields.counted_bytes();
  fields.check_whole(thing);
  return image;
}

cv::Mat decode(const ImageMessage& message, int max_megapixels, const std::string& thing) {
  if (message.is_compressed) {
    return images::decode_image({message.data.begin(), message.data.end()}, max_megapixels, thing);
  }
  try {
    return raw_image(message, max_megapixels, thing);
  } catch (const cv::Exception& error) {
    fail(thing, fmt::format("cannot be converted (OpenCV: {}): record it again", error.err));
  }
}

}  // namespace loopbit::recordings
