// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/error.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

// For GoogleTest's messages.
std::ostream& operator<<(std::ostream& stream, const Candidate& candidate);
std::ostream& operator<<(std::ostream& stream, const Match& match);
std::ostream& operator<<(std::ostream& stream, Status status);
std::ostream& operator<<(std::ostream& stream, ErrorKind kind);

}  // namespace loopbit

namespace loopbit::test {

/// T_world_camera of a camera that turned by `yaw`, radians, about the vertical axis.
cv::Matx44d level_pose(double x, double z, double yaw);

/// Random numbers that are the same on every machine, which those of <random>'s distributions are
/// not. Every test starts from the same seed; another `stream` has other numbers.
class Random {
 public:
  explicit Random(int stream = 0) : state_(2019 + (static_cast<std::uint64_t>(stream) << 32U)) {}

  std::uint64_t bits();
  /// Both ends included.
  int between(int first, int last);
  /// In [0, 1).
  double uniform();
  /// Mean 0, standard deviation 1, within +-6.
  double normal();

 private:
  std::uint64_t state_;
};

/// Each bit is set with the probability `density`.
BinaryContent random_content(Random& random, double density);

/// All 4096 bits set.
BinaryContent full_content();

/// Overlapping rectangles and discs of all sizes and grey levels, slightly smoothed. Another
/// `scene` is another picture; the same one is the same on every machine.
cv::Mat1b textured_image(cv::Size size, int scene);

/// The mean grey level of each of size.width x size.height equal parts of an image, by the share of
/// every pixel in it.
cv::Mat1b area_means(const cv::Mat1b& gray, cv::Size size);

/// A camera's 320 x 240 view of `scene` from a spot `moved_px` beside the usual one, at most 40 px.
cv::Mat1b view(int scene, cv::Point moved_px = {0, 0});

/// Adds grey-level noise of the standard deviation `sigma`.
cv::Mat1b with_noise(const cv::Mat1b& image, double sigma, Random& random);

/// The lines of a text file; none if it cannot be read.
std::vector<std::string> lines_of(const std::string& path);

/// Expects `action` to throw Error of `kind` whose sentence has all of `parts`.
void expect_error(ErrorKind kind, std::initializer_list<std::string_view> parts,
                  const std::function<void()>& action);

/// The folder of real images, which the environment variable LOOPBIT_DATA names.
std::optional<std::filesystem::path> data_dir();

/// What has to be done for the real images `name` to be found, or an empty text.
std::string missing_data(const std::string& name);

/// The grey picture of the image number `index` (in the order of names) in a folder of real images.
cv::Mat1b real_image(const std::string& folder, std::size_t index);

/// A real image by its path in data_dir().
cv::Mat1b real_image(const std::string& path);

/// A folder of its own for each test, removed afterwards.
class ScratchTest : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  /// Of a file, or of the folder itself.
  [[nodiscard]] std::string path(const std::string& name = "") const {
    return (name.empty() ? root_ : root_ / name).string();
  }
  /// Writes a file, and the folders it lies in; returns its path.
  std::string write(const std::string& name, std::string_view text) const;

 private:
  std::filesystem::path root_;
};

}  // namespace loopbit::test

/// Skips the test, saying what is missing, where the real images `name` are not at hand.
#define LOOPBIT_NEEDS_DATA(name)                                                         \
  if (const std::string missing = loopbit::test::missing_data(name); !missing.empty()) { \
    GTEST_SKIP() << missing;                                                             \
  }                                                                                      \
  static_assert(true)
