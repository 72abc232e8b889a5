// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include <opencv2/core.hpp>

#include "field_reader.hpp"

namespace loopbit::recordings {

/// sensor_msgs Image or CompressedImage, of ROS 1 or ROS 2. Refers to the bytes it was read from.
struct ImageMessage {
  Header header;
  bool is_compressed = false;
  std::string encoding;  ///< such as "bgr8"; "jpeg" and the like of a compressed image
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t step = 0;  ///< bytes from row to row
  bool is_big_endian = false;
  Bytes data;
};

/// Whether messages of such a channel are images that read_image_message() reads.
bool is_image(const Channel& channel);

/// Reads a message of a channel that is_image(). Throws Error (kind input) if it is cut off or
/// garbled; `thing` begins the sentence.
ImageMessage read_image_message(const Channel& channel, Bytes message, const std::string& thing);

/// The image, 8- or 16-bit, grey, BGR or BGRA, in memory of its own. Throws Error (kind input) if
/// the encoding is unknown, the message has fewer bytes than it declares, or more pixels than
/// `max_megapixels`; `thing` begins the sentence.
cv::Mat decode(const ImageMessage& message, int max_megapixels, const std::string& thing);

}  // namespace loopbit::recordings
