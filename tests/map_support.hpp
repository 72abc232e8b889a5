// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/known_motion.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/surf.hpp"

namespace loopbit::test {

// Maps whose every value follows from its frame's number, so that any place can be judged.

/// Small images, few keypoints.
LoopDetectorOptions fast_options();

/// The content of frame `number`.
BinaryContent content_of(int number);

/// Three features of frame `number`.
Features few_features(int number);

/// The odometry of frame `number`. Even frames have a covariance.
OdometryPose odometry_of(int number);

/// The relative pose of a loop of frame `number`.
KnownMotion motion_of(int number);

bool same_features(const Features& a, const Features& b);

/// What encode_image() makes of frame `number`: 1 KB.
std::vector<unsigned char> image_bytes(int number);

/// For MapWriter: gives the image_bytes() of the frame that add_frame() added.
std::vector<unsigned char> encode_image(const cv::Mat& image);

/// `loop`: the place that the frame is found to be.
void add_frame(MapWriter& map, int frame, std::optional<SessionFrame> loop = std::nullopt);

/// Adds a session of so many frames to a map.
void add_session(const std::string& path, int frames, const std::string& name = "drive",
                 std::optional<SessionFrame> loop_of_last = std::nullopt,
                 const EncodeImage& encode = {});

std::vector<MapPlace> places_of(MapReader& map);
std::vector<MapPlace> places_of(const std::string& path);

/// Expects every place and its odometry to be what add_frame() wrote for its frame, with its
/// features and image or without.
void expect_only_true_places(MapReader& map);

std::string read_bytes(const std::string& path);

/// Whether the map is in the file alone, which can be read without the right to write: it has no
/// log, and its header asks for none.
bool is_one_file(const std::string& path);

/// Makes a map one of an earlier version, without the tables that it lacks.
void make_older(const std::string& path, int version);

/// Changes a SQLite file, made if there is none, as no map of ours is changed.
void change(const std::string& path, const std::string& sql);

}  // namespace loopbit::test
