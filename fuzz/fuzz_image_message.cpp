// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The first byte says what the others are: a raw or a compressed image, of ROS 2 or ROS 1.
#include <array>

#include "loopbit/error.hpp"

#include "image_message.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace recordings = loopbit::recordings;
  constexpr int kMegapixels = 1;
  constexpr std::array kTypes = {"sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"};
  if (size == 0) return 0;
  const bool is_ros1 = (data[0] & 2U) != 0;
  const recordings::Channel channel{
      .topic = "/camera",
      .type = kTypes.at(data[0] & 1U),
      .encoding = is_ros1 ? recordings::Encoding::ros1 : recordings::Encoding::cdr};
  try {
    const auto message = recordings::read_image_message(channel, {data + 1, size - 1}, "An image");
    (void)recordings::decode(message, kMegapixels, "An image");
  } catch (const loopbit::Error&) {  // refused, as it should be
  }
  return 0;
}
