// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/image_source.hpp"

namespace loopbit {

/// A topic of a recording.
struct Topic {
  std::string name;            ///< such as "/camera/image_raw"
  std::string type;            ///< of its messages, such as "sensor_msgs/msg/Image"
  std::uint64_t messages = 0;  ///< how many there are
  bool has_images = false;     ///< open_recording() reads them
};

/// What a recording holds.
struct RecordingInfo {
  std::string description;    ///< one line, such as "ROS 1 bag drive.bag"
  std::vector<Topic> topics;  ///< by name
  double duration_s = 0;      ///< from the first message to the last, of any topic
  std::string damage = {};    ///< a sentence if something is missing, as far as it was looked for
};

/// True if `input` is, by its name, a recording of ROS or MCAP: a file .bag (or .bag.active, which
/// a killed recorder leaves), .db3 or .mcap, or a folder with a .db3 or .mcap file and no image.
[[nodiscard]] bool is_recording(const std::string& input);

/// Lists the topics of a recording. Reads the index if there is one, otherwise all of the file:
/// some seconds per 10 GB, or a minute if it is compressed. Throws Error (kind input) if it cannot
/// be read.
RecordingInfo read_recording_info(const std::string& input);

/// Opens the images of a recording: messages of the type sensor_msgs Image or CompressedImage of
/// ROS 1 or ROS 2, on `topic`, or on the only topic that has images if that is empty.
///
/// Formats: ROS 1 bags (version 2.0; chunks with none, bz2 or lz4), the SQLite files of ROS 2 (also
/// with messages compressed one by one), MCAP (chunks with none, lz4 or zstd; messages of ROS 2, or
/// of ROS 1). The files of a folder are read one after another, in natural order. Encodings: mono8,
/// mono16, bgr8, rgb8, bgra8, rgba8, the same of 16 bits, 8UC1, 8UC3, 8UC4, 16UC1, bayer_*8,
/// bayer_*16, yuv422 and yuv422_yuy2; JPEG and PNG.
///
/// Frames come in the order in which they were recorded. Their time is that of the header; where
/// that is 0, the time of recording. Their name is this time with nine decimals. A recording that
/// is cut off or lacks its index is read as far as it goes; early_end() then says so. It also
/// reports damaged chunks, which are left out.
///
/// `odometry_topic`: if not empty, gives each frame the pose of the camera that is nearest in time
/// (Frame::T_odometry_camera), from messages nav_msgs Odometry, tf2_msgs TFMessage, or
/// geometry_msgs PoseStamped, PoseWithCovarianceStamped or TransformStamped. Where the camera is on
/// the robot comes from /tf_static, or /tf if that does not move there. Of the frames of TF, those
/// from the camera up to `odom` count, or up to the root. A pose without a child frame is that of
/// the camera. This reads the recording two or three times before the first frame, and takes 140
/// bytes per message.
///
/// Throws Error: kind input if the recording cannot be read, has no images on any topic or on
/// `topic`, or does not say where the camera is on the robot; kind option if `max_megapixels` is
/// less than 1, if there is no such topic, or `topic` is empty and several have images. The message
/// then lists them.
std::unique_ptr<ImageSource> open_recording(const std::string& input, const std::string& topic = {},
                                            int max_megapixels = kMaxMegapixels,
                                            const std::string& odometry_topic = {});

/// open_recording() for a recording, otherwise open_source(). Throws Error as they do, and kind
/// option if a topic is given, but `input` is no recording.
std::unique_ptr<ImageSource> open_input(const std::string& input, const std::string& topic = {},
                                        int max_megapixels = kMaxMegapixels,
                                        const std::string& odometry_topic = {});

/// The calibration of the camera whose images open_recording() reads: the first sensor_msgs
/// CameraInfo on `camera_info` beside their topic, as the YAML of ROS' camera_calibration, which
/// read_cameras() reads. Its region of interest and binning are applied; images on a topic with
/// "rect" in its name have no distortion. Empty if there is none, or the camera is not calibrated.
/// Throws Error as open_recording(), and kind input if the message is damaged.
std::string recorded_camera_info(const std::string& input, const std::string& topic = {});

}  // namespace loopbit
