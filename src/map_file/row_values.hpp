// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/map_database.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

// How the rows of a map hold values, as in docs/format.md. All numbers are little-endian.

/// The 512 bytes of `content`, valid as long as it is: 64 rows of 64 bits.
std::span<const unsigned char> content_bytes(const BinaryContent& content);
/// False, and `content` unchanged, unless there are 512 bytes.
bool read_content(std::span<const unsigned char> bytes, BinaryContent& content);

/// 16 bytes, plus 80 bytes per feature.
std::vector<unsigned char> features_bytes(const Features& features);
/// None unless the bytes are features within the limits of SurfOptions.
std::optional<Features> features_from(std::span<const unsigned char> bytes);

/// The first three rows of a pose, then the upper triangle of its covariance, row by row.
using PoseNumbers = std::array<double, 12 + 21>;
PoseNumbers pose_numbers(const cv::Matx44d& pose, const cv::Matx66d& covariance);
/// Valid as long as `numbers`.
std::span<const unsigned char> bytes_of(const PoseNumbers& numbers);
/// None unless the bytes are those of pose_numbers().
std::optional<Motion> motion_from(std::span<const unsigned char> bytes);

// Checksums: the CRC-32 of zlib over the key and the values of a row. The order of values differs
// from table to table, so that no row passes for one of another.

std::int64_t checksum_of(const MapSession& session);
std::int64_t checksum_of(const MapPlace& place);
std::int64_t checksum_of_features(std::span<const unsigned char> bytes, const SessionFrame& at);
std::int64_t checksum_of_image(std::span<const unsigned char> jpeg, const SessionFrame& at);
std::int64_t checksum_of(const MapLoop& loop);
std::int64_t checksum_of_rejected(const MapLoop& loop);
std::int64_t checksum_of(const MapOdometry& odometry, std::span<const unsigned char> pose);
std::int64_t checksum_of(const MapLoopPose& pose, std::span<const unsigned char> bytes);
std::int64_t checksum_of_linked(int session);

}  // namespace loopbit
