// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/gray_image.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "loopbit/error.hpp"
#include "loopbit/picture.hpp"

namespace loopbit {
namespace {

void check_type(const cv::Mat& image) {
  const bool depth_known = image.depth() == CV_8U || image.depth() == CV_16U;
  const int channels = image.channels();
  if (!depth_known || (channels != 1 && channels != 3 && channels != 4)) {
    throw Error(ErrorKind::input,
                fmt::format("The image is of OpenCV type {}; convert it to 8 or 16 bits unsigned "
                            "with 1, 3 (BGR) or 4 (BGRA) channels.",
                            cv::typeToString(image.type())));
  }
}

cv::Mat to_single_channel(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat gray;
  cv::cvtColor(image, gray, image.channels() == 3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
  return gray;
}

/// The smallest value that at least `rank` pixels do not exceed.
std::uint16_t value_at_rank(const std::vector<std::size_t>& histogram, std::size_t rank) {
  std::size_t seen = 0;
  for (std::size_t value = 0; value < histogram.size(); ++value) {
    seen += histogram[value];
    if (seen >= rank) return static_cast<std::uint16_t>(value);
  }
  return 65535;
}

cv::Mat1b stretch_to_8_bits(const cv::Mat1w& image) {
  const auto [dark, bright] = gray_range(image);
  const int span = bright - dark;
  cv::Mat1b stretched(image.size());
  std::transform(
      image.begin(), image.end(), stretched.begin(),
      [=, low = dark, high = bright](std::uint16_t value) {
        return static_cast<std::uint8_t>((std::clamp<int>(value, low, high) - low) * 255 / span);
      });
  return stretched;
}

}  // namespace

void check_size(const cv::Mat& image) {
  if (image.empty()) {
    throw Error(ErrorKind::input, "The image is empty; give one of at least 32 x 32 pixels.");
  }
  if (image.dims != 2) {
    throw Error(ErrorKind::input,
                fmt::format("The image has {} dimensions; give one of 2.", image.dims));
  }
  if (image.cols < kMinImageSidePx || image.rows < kMinImageSidePx) {
    throw Error(ErrorKind::input,
                fmt::format("The image has {} x {} pixels; at least {} x {} are needed.",
                            image.cols, image.rows, kMinImageSidePx, kMinImageSidePx));
  }
}

GrayRange gray_range(const cv::Mat1w& image) {
  std::vector<std::size_t> histogram(65536, 0);
  for (const std::uint16_t value : image) ++histogram[value];
  const std::size_t thousandth = image.total() / 1000 + 1;
  const int dark = value_at_rank(histogram, thousandth);
  const int bright = value_at_rank(histogram, image.total() - thousandth + 1);
  return {dark, std::max(bright, dark + 1)};
}

cv::Mat1b gray_image(const cv::Mat& image) {
  check_size(image);
  check_type(image);
  cv::Mat gray = to_single_channel(image);
  if (gray.depth() == CV_16U) return stretch_to_8_bits(gray);
  return gray;
}

}  // namespace loopbit
