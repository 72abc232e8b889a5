// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

namespace loopbit::images {

/// The image in `file`, with depth and channels as stored (alpha is dropped) and not turned by
/// EXIF orientation. Throws Error (kind input) if it cannot be read whole, is over 512 MiB, or has
/// more pixels than `max_megapixels` by its header; it is not decoded then.
cv::Mat read_image_file(const std::filesystem::path& file, int max_megapixels);

/// As read_image_file(), of the bytes of such a file; `thing` begins the sentence of an error.
cv::Mat decode_image(const std::vector<unsigned char>& bytes, int max_megapixels,
                     const std::string& thing);

/// Throws Error (kind option) if `max_megapixels` is less than 1.
void check_max_megapixels(int max_megapixels);

/// Throws Error (kind input) if an image of such a size is too large; `thing` begins the sentence.
void check_pixel_count(std::int64_t width, std::int64_t height, int max_megapixels,
                       const std::string& thing);

/// Throws Error (kind input) unless a Frame may hold `image`; `thing` begins the sentence.
void check_pixel_format(const cv::Mat& image, const std::string& thing);

/// Told by extension only, in either case of letters.
bool is_image_name(const std::filesystem::path& name);

/// The extensions of is_image_name, for messages.
std::string image_extensions();

/// In lower case, with its dot.
std::string lower_extension(const std::filesystem::path& name);

/// Runs of digits count as numbers: 2.png comes before 10.png. Names that differ in leading zeros
/// only are ordered byte by byte, so that the order is total.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace loopbit::images
