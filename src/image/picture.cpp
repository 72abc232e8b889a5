// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/picture.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace loopbit {

cv::Mat halved_to_picture(const cv::Mat& image) {
  cv::Mat picture = image;
  while (std::max(picture.cols, picture.rows) >= 2 * kPictureSide_px &&
         std::min(picture.cols, picture.rows) >= 2) {
    const cv::Size half = picture.size() / 2;
    cv::Mat halved;
    cv::resize(picture(cv::Rect(cv::Point(), half * 2)), halved, half, 0, 0, cv::INTER_AREA);
    picture = halved;
  }
  return picture.data == image.data ? image.clone() : picture;
}

}  // namespace loopbit
