// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>

#include <opencv2/core.hpp>

namespace sensor_msgs::msg {

struct Image {
  using ConstSharedPtr = std::shared_ptr<const Image>;
  struct {
    struct {
      std::int32_t sec = 0;
      std::uint32_t nanosec = 0;
    } stamp;
  } header;
  cv::Mat image;  ///< in place of the bytes
};

}  // namespace sensor_msgs::msg
