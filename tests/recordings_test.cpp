// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Small recordings of other libraries; tests/recordings has the larger ones.
#include "loopbit/recordings.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "motion_message.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

const fs::path kSeeds = LOOPBIT_FUZZ_CORPUS;

std::string seed(const char* name) { return (kSeeds / name).string(); }

const std::vector<std::string> kRecordings = {
    seed("mcap/none.mcap"),        seed("mcap/lz4.mcap"),    seed("mcap/zstd.mcap"),
    seed("mcap/unchunked.mcap"),   seed("mcap/ros1.mcap"),   seed("ros1_bag/none.bag"),
    seed("ros1_bag/lz4.bag"),      seed("ros1_bag/bz2.bag"), seed("ros2_database/raw.db3"),
    seed("ros2_database/zstd.db3")};

/// Byte i of the picture that all seeds have on two topics has the value i.
void expect_picture(const cv::Mat& image) {
  ASSERT_EQ(image.type(), CV_8UC3);
  ASSERT_EQ(image.size(), cv::Size(8, 6));
  const cv::Mat bytes = image.reshape(1, 1);
  for (int i = 0; i < bytes.cols; ++i) ASSERT_EQ(bytes.at<unsigned char>(i), i);
}

TEST(Recordings, ReadEveryContainer) {
  for (const std::string& recording : kRecordings) {
    SCOPED_TRACE(recording);
    ASSERT_TRUE(is_recording(recording));
    const RecordingInfo info = read_recording_info(recording);
    EXPECT_EQ(info.damage, "");
    EXPECT_NEAR(info.duration_s, 0.0667, 0.001);
    ASSERT_EQ(info.topics.size(), 3U);
    for (const Topic& topic : info.topics) {
      EXPECT_TRUE(topic.has_images);
      const auto source = open_recording(recording, topic.name);
      EXPECT_EQ(source->size(), 1U);
      Frame frame;
      ASSERT_TRUE(source->next(frame));
      EXPECT_EQ(frame.error, "");
      if (topic.name == "/camera/image_raw") {
        EXPECT_EQ(frame.name, "1700000000.000000000");
        expect_picture(frame.image);
      }
      EXPECT_FALSE(source->next(frame));
      EXPECT_FALSE(source->next(frame));
      EXPECT_EQ(source->early_end(), "");
    }
  }
}

using RecordingFiles = test::ScratchTest;

TEST_F(RecordingFiles, CutAnywhereGiveErrorsOrFewerFrames) {
  for (const std::string& recording : kRecordings) {
    const fs::path cut = path(fs::path(recording).filename().string());
    const auto size = static_cast<std::streamsize>(fs::file_size(recording));
    std::string bytes(static_cast<std::size_t>(size), '\0');
    std::ifstream(recording, std::ios::binary).read(bytes.data(), size);
    for (std::size_t kept = 0; kept < bytes.size(); kept += 1 + bytes.size() / 60) {
      std::ofstream(cut, std::ios::binary) << bytes.substr(0, kept);
      try {
        const auto source = open_recording(cut.string(), "/camera/image_raw");
        bool is_read = false;
        for (Frame frame; source->next(frame);) {
          EXPECT_EQ(frame.error, "");
          expect_picture(frame.image);
          is_read = true;
        }
        const bool is_told = source->early_end().find("missing") != std::string::npos;
        EXPECT_TRUE(is_read || is_told) << cut << ' ' << kept;
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(cut.string()), std::string::npos) << error.what();
      }
    }
  }
}

/// What is read of a message of the topic, as text.
std::string read_motion(const recordings::Channel& channel, recordings::Bytes message) {
  if (recordings::is_camera_info(channel)) {
    return recordings::read_camera_info(channel, message, false, "It");
  }
  std::string text;
  for (const auto& read : recordings::read_transforms(channel, message, "It")) {
    text += fmt::format("{} {} {} {}\n", read.time_s, read.parent, read.child,
                        fmt::join(read.T_parent_child.val, " "));
  }
  return text;
}

/// The first byte of a seed says what the others are, see fuzz/fuzz.cpp.
TEST(MotionMessages, CutAnywhereGiveAnErrorOrTheSame) {
  constexpr std::array kTypes = {"nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped",
                                 "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/CameraInfo"};
  int seeds = 0;
  for (const auto& entry : fs::directory_iterator(kSeeds / "motion_message")) {
    SCOPED_TRACE(entry.path());
    ++seeds;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<unsigned char> seed(std::istreambuf_iterator<char>(file), {});
    ASSERT_GT(seed.size(), 1U);
    const recordings::Channel channel{
        .topic = "/topic",
        .type = kTypes.at(seed[0] & 3U),
        .encoding = (seed[0] & 4U) != 0 ? recordings::Encoding::ros1 : recordings::Encoding::cdr};
    const recordings::Bytes message = recordings::Bytes(seed).subspan(1);
    const std::string whole = read_motion(channel, message);
    EXPECT_NE(whole, "");
    std::size_t refused = 0;
    for (std::size_t size = 0; size < message.size(); ++size) {
      try {
        EXPECT_EQ(read_motion(channel, message.first(size)), whole) << size;
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("It "), std::string::npos);
        ++refused;
      }
    }
    EXPECT_GT(refused, 56U) << "a pose alone has so many bytes";
  }
  EXPECT_EQ(seeds, 8);
}

TEST_F(RecordingFiles, AreToldByName) {
  for (const char* name : {"a.bag", "a.bag.active", "a.DB3", "a.mcap"}) {
    EXPECT_TRUE(is_recording(path(name))) << name;
  }
  for (const char* name : {"a.active", "a.db", "a.mp4", "bag"}) {
    EXPECT_FALSE(is_recording(path(name))) << name;
  }
  write("a_0.mcap", "x");
  EXPECT_TRUE(is_recording(path()));
  write("000.png", "x");
  EXPECT_FALSE(is_recording(path())) << "a folder of images";
}

TEST(Recordings, ErrorsNameTheTopics) {
  const std::string recording = seed("mcap/none.mcap");
  test::expect_error(ErrorKind::option, {"several topics", "/bayer", "/c", "/camera/image_raw"},
                     [&] { (void)open_input(recording); });
  test::expect_error(ErrorKind::option, {"'/x'", "/bayer", "/c", "/camera/image_raw"},
                     [&] { (void)open_input(recording, "/x"); });
  test::expect_error(ErrorKind::option, {"'/x'", "is no recording"},
                     [&] { (void)open_input("a.png", "/x"); });
  test::expect_error(ErrorKind::option, {"max_megapixels is 0"},
                     [&] { (void)open_input(recording, "/c", 0); });
}

}  // namespace
}  // namespace loopbit
