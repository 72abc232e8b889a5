// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What libFuzzer feeds: everything of ours that reads a file. LOOPBIT_FUZZ names the reader, as
// scripts/fuzz sets it. A reader may give values or throw Error; anything else is a finding.
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/match_list.hpp"
#include "loopbit/recordings.hpp"
#include "loopbit/truth_file.hpp"

#include "camera_poses.hpp"
#include "encoded_image.hpp"
#include "encoded_video.hpp"
#include "image_message.hpp"
#include "motion_message.hpp"
#include "run_files.hpp"
#include "sequence_lists.hpp"

namespace loopbit {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr int kMegapixels = 1;

/// Gives `read` the path of a file that ends in `extension` and holds the bytes.
template <typename Read>
void read_as_file(Bytes bytes, const char* extension, const Read& read) {
  namespace fs = std::filesystem;
  const std::string path =
      (fs::temp_directory_path() / fmt::format("loopbit_fuzz_{}{}", getpid(), extension)).string();
  for (const char* suffix : {"-journal", "-wal", "-shm"}) fs::remove(path + suffix);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  read(path);
}

/// The first byte of a message says its type, by its lowest bits, and by the next one whether it is
/// of ROS 1 or of ROS 2.
template <std::size_t kNumTypes>
recordings::Channel channel_of(std::uint8_t first,
                               const std::array<const char*, kNumTypes>& types) {
  static_assert(std::has_single_bit(kNumTypes));
  return {.topic = "/topic",
          .type = types.at(first % kNumTypes),
          .encoding =
              (first & kNumTypes) != 0 ? recordings::Encoding::ros1 : recordings::Encoding::cdr};
}

void fuzz_image_headers(Bytes bytes) {
  (void)images::is_cut_off(bytes);
  (void)images::declared_size(bytes);
  read_as_file(bytes, ".avi", [](const std::string& path) { (void)images::declared_bytes(path); });
}

void fuzz_image_list(Bytes bytes) {
  read_as_file(bytes, ".csv", [](const std::string& path) { (void)images::list_file(path); });
}

void fuzz_image_message(Bytes bytes) {
  constexpr std::array kTypes = {"sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"};
  if (bytes.empty()) return;
  const auto message =
      recordings::read_image_message(channel_of(bytes[0], kTypes), bytes.subspan(1), "An image");
  (void)recordings::decode(message, kMegapixels, "An image");
}

void fuzz_loops(Bytes bytes) {
  read_as_file(bytes, ".csv",
               [](const std::string& path) { (void)match_list(read_detections(path)); });
}

void fuzz_map(Bytes bytes) {
  read_as_file(bytes, ".db", [](const std::string& path) {
    (void)check_map(path);
    MapReader map(path);
    map.for_each_earlier_place([](const auto&, const auto&) {});
    (void)map.images();
    (void)export_loops(map, ExportFormat::json);
    (void)export_loops(map, ExportFormat::g2o);
    (void)map.odometry();
    (void)map.options();
  });
}

/// MATLAB 5 files alone: those of 7.3 are HDF5, whose library (1.10) is known to crash on damaged
/// files; loopbit checks their signature and length and has no more to do with them.
void fuzz_mat(Bytes bytes) {
  constexpr std::string_view kHdf5 = "\x89HDF";
  if (std::search(bytes.begin(), bytes.end(), kHdf5.begin(), kHdf5.end(), [](auto a, auto b) {
        return a == static_cast<std::uint8_t>(b);
      }) != bytes.end()) {
    return;
  }
  read_as_file(bytes, ".mat", [](const std::string& path) { (void)read_truth(path); });
}

void fuzz_match_list(Bytes bytes) {
  read_as_file(bytes, ".csv", [](const std::string& path) { (void)read_match_list(path); });
}

/// Of a camera, the first byte also says whether its images are rectified.
void fuzz_motion_message(Bytes bytes) {
  constexpr std::array kTypes = {"nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped",
                                 "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/CameraInfo"};
  if (bytes.empty()) return;
  const recordings::Channel channel = channel_of(bytes[0], kTypes);
  const Bytes message = bytes.subspan(1);
  if (!recordings::is_camera_info(channel)) {
    (void)recordings::read_transforms(channel, message, "A message");
    return;
  }
  const bool is_rectified = (bytes[0] & 8U) != 0;
  const std::string yaml =
      recordings::read_camera_info(channel, message, is_rectified, "A message");
  if (!yaml.empty()) (void)parse_camera_info(yaml, "A message");
}

/// What is accepted is within all ranges, and comes back from its own text.
void fuzz_options(Bytes bytes) {
  const std::string text(bytes.begin(), bytes.end());
  const std::string json = to_json(options_from_json(text, "settings"));
  if (to_json(options_from_json(json, "settings")) != json) std::abort();
}

void fuzz_poses(Bytes bytes) {
  read_as_file(bytes, ".txt", [](const std::string& path) {
    const auto poses = read_poses(path);
    (void)truth_from_poses({poses.begin(), poses.end()});
  });
}

/// Lists the topics of a recording, and reads all images of each.
void read_whole_recording(const std::string& path) {
  for (const Topic& topic : read_recording_info(path).topics) {
    if (!topic.has_images || topic.messages == 0 || topic.name.empty()) continue;
    const auto source = open_recording(path, topic.name, kMegapixels);
    for (Frame frame; source->next(frame);) {
    }
    (void)source->early_end();
  }
}

void fuzz_mcap(Bytes bytes) { read_as_file(bytes, ".mcap", read_whole_recording); }

void fuzz_ros1_bag(Bytes bytes) { read_as_file(bytes, ".bag", read_whole_recording); }

void fuzz_ros2_database(Bytes bytes) { read_as_file(bytes, ".db3", read_whole_recording); }

void fuzz_truth(Bytes bytes) {
  read_as_file(bytes, ".txt", [](const std::string& path) {
    (void)truth_kind(path);
    (void)read_truth(path);
  });
}

using Reader = void (*)(Bytes);

/// One for each folder of fuzz/corpus. Ends the program for another name.
Reader reader_named(std::string_view name) {
  constexpr std::array kReaders = {std::pair("image_headers", &fuzz_image_headers),
                                   std::pair("image_list", &fuzz_image_list),
                                   std::pair("image_message", &fuzz_image_message),
                                   std::pair("loops", &fuzz_loops),
                                   std::pair("map", &fuzz_map),
                                   std::pair("mat", &fuzz_mat),
                                   std::pair("match_list", &fuzz_match_list),
                                   std::pair("mcap", &fuzz_mcap),
                                   std::pair("motion_message", &fuzz_motion_message),
                                   std::pair("options", &fuzz_options),
                                   std::pair("poses", &fuzz_poses),
                                   std::pair("ros1_bag", &fuzz_ros1_bag),
                                   std::pair("ros2_database", &fuzz_ros2_database),
                                   std::pair("truth", &fuzz_truth)};
  for (const auto& [known, reader] : kReaders) {
    if (name == known) return reader;
  }
  fmt::print(stderr,
             "fuzz: there is no reader '{}'; LOOPBIT_FUZZ must be a folder of fuzz/corpus.\n",
             name);
  std::exit(2);
}

Reader read_input = nullptr;

}  // namespace
}  // namespace loopbit

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  const char* name = std::getenv("LOOPBIT_FUZZ");
  loopbit::read_input = loopbit::reader_named(name != nullptr ? name : "");
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    loopbit::read_input({data, size});
  } catch (const loopbit::Error&) {  // refused, as it should be
  }
  return 0;
}
