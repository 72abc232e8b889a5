// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "sensor_msgs/msg/image.hpp"

namespace cv_bridge {

struct CvImage {
  cv::Mat image;
};

inline std::shared_ptr<const CvImage> toCvShare(
    const sensor_msgs::msg::Image::ConstSharedPtr& message, const std::string& /*encoding*/) {
  if (message->image.empty()) throw std::runtime_error("not this encoding");
  return std::make_shared<CvImage>(CvImage{message->image});
}

}  // namespace cv_bridge
