// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/picture_jpeg.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/picture.hpp"

namespace loopbit {
namespace {

constexpr int kJpegQuality = 75;

/// 8 bits, one channel or three.
cv::Mat displayable(const cv::Mat& image) {
  cv::Mat eight_bit = image;
  if (image.depth() == CV_16U) image.convertTo(eight_bit, CV_8U, 1.0 / 257.0);
  if (eight_bit.channels() == 4) cv::cvtColor(eight_bit, eight_bit, cv::COLOR_BGRA2BGR);
  return eight_bit;
}

}  // namespace

std::vector<unsigned char> picture_jpeg(const cv::Mat& image) {
  const double scale =
      std::min(1.0, static_cast<double>(kPictureSide_px) / std::max(image.cols, image.rows));
  const cv::Size size(std::max(1, static_cast<int>(std::lround(image.cols * scale))),
                      std::max(1, static_cast<int>(std::lround(image.rows * scale))));
  cv::Mat picture;
  cv::resize(displayable(halved_to_picture(image)), picture, size, 0, 0, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return bytes;
}

}  // namespace loopbit
