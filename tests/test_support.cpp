// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "test_support.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <unistd.h>

namespace loopbit {

std::ostream& operator<<(std::ostream& stream, const Candidate& candidate) {
  return stream << "place " << candidate.place << " at " << candidate.similarity;
}

std::ostream& operator<<(std::ostream& stream, const Match& match) {
  return stream << match.query << '-' << match.place;
}

std::ostream& operator<<(std::ostream& stream, Status status) {
  return stream << to_string(status);
}

std::ostream& operator<<(std::ostream& stream, ErrorKind kind) {
  return stream << "error of kind " << static_cast<int>(kind);
}

}  // namespace loopbit

namespace loopbit::test {

namespace fs = std::filesystem;

cv::Matx44d level_pose(double x, double z, double yaw) {
  return {std::cos(yaw),  0, std::sin(yaw), x, 0, 1, 0, 0,
          -std::sin(yaw), 0, std::cos(yaw), z, 0, 0, 0, 1};
}

std::uint64_t Random::bits() {  // SplitMix64
  state_ += 0x9e3779b97f4a7c15U;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

int Random::between(int first, int last) {
  const auto values = static_cast<std::uint64_t>(last - first) + 1;
  return first + static_cast<int>(bits() % values);
}

double Random::uniform() { return static_cast<double>(bits() >> 11U) / 9007199254740992.0; }

double Random::normal() {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += uniform();
  return sum;
}

BinaryContent random_content(Random& random, double density) {
  BinaryContent content;
  for (std::uint64_t& row : content.rows) {
    for (int x = 0; x < kContentSide; ++x) {
      row |= static_cast<std::uint64_t>(random.uniform() < density) << x;
    }
  }
  return content;
}

BinaryContent full_content() {
  BinaryContent content;
  content.rows.fill(~std::uint64_t{0});
  return content;
}

cv::Mat1b textured_image(cv::Size size, int scene) {
  Random random(scene);
  cv::Mat1b image(size, static_cast<std::uint8_t>(random.between(80, 170)));
  const int largest_px = std::max(8, std::min(size.width, size.height) / 4);
  const int shapes = std::max(30, size.area() / 250);
  for (int i = 0; i < shapes; ++i) {
    // Arguments may be evaluated in any order; these lines are.
    const int y = random.between(0, size.height);
    const int x = random.between(0, size.width);
    // Few large shapes below, many small ones on top.
    const int side_px = std::max(3, largest_px * (shapes - i) / shapes * random.between(1, 4) / 4);
    const cv::Scalar level(random.between(0, 255));
    if (random.between(0, 1) == 0) {
      cv::circle(image, {x, y}, side_px / 2, level, cv::FILLED);
    } else {
      const cv::Size sides(side_px, std::max(3, side_px * random.between(1, 4) / 2));
      cv::rectangle(image, cv::Rect({x, y}, sides), level, cv::FILLED);
    }
  }
  cv::GaussianBlur(image, image, {0, 0}, 0.8);
  return image;
}

cv::Mat1b area_means(const cv::Mat1b& gray, cv::Size size) {
  // One row a part, one column a pixel.
  const auto shares_of = [](int parts, int pixels) {
    cv::Mat1d shares(parts, pixels);
    const double side = static_cast<double>(pixels) / parts;
    for (int part = 0; part < parts; ++part) {
      for (int pixel = 0; pixel < pixels; ++pixel) {
        const double share =
            std::min(pixel + 1.0, (part + 1) * side) - std::max(double(pixel), part * side);
        shares(part, pixel) = std::max(0.0, share) / side;
      }
    }
    return shares;
  };
  cv::Mat1d pixels;
  gray.convertTo(pixels, CV_64F);
  cv::Mat1d sums;
  cv::gemm(shares_of(size.height, gray.rows) * pixels, shares_of(size.width, gray.cols), 1,
           cv::noArray(), 0, sums, cv::GEMM_2_T);
  cv::Mat1b means(size);
  // Halves go up; a little more makes up for the rounding of doubles.
  std::transform(sums.begin(), sums.end(), means.begin(),
                 [](double sum) { return static_cast<std::uint8_t>(sum + 0.5 + 1e-9); });
  return means;
}

cv::Mat1b view(int scene, cv::Point moved_px) {
  constexpr int kMarginPx = 40;
  const cv::Mat1b all = textured_image({320 + 2 * kMarginPx, 240 + 2 * kMarginPx}, scene);
  return all(cv::Rect(kMarginPx + moved_px.x, kMarginPx + moved_px.y, 320, 240)).clone();
}

cv::Mat1b with_noise(const cv::Mat1b& image, double sigma, Random& random) {
  cv::Mat1b noisy(image.size());
  std::transform(image.begin(), image.end(), noisy.begin(), [&](std::uint8_t level) {
    return cv::saturate_cast<std::uint8_t>(level + sigma * random.normal());
  });
  return noisy;
}

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

void expect_error(ErrorKind kind, std::initializer_list<std::string_view> parts,
                  const std::function<void()>& action) {
  try {
    action();
    ADD_FAILURE() << "nothing was thrown";
  } catch (const Error& error) {
    const std::string sentence = error.what();
    EXPECT_EQ(error.kind(), kind) << sentence;
    for (const std::string_view part : parts) {
      EXPECT_NE(sentence.find(part), std::string::npos) << "no '" << part << "' in: " << sentence;
    }
  }
}

std::optional<fs::path> data_dir() {
  const char* folder = std::getenv("LOOPBIT_DATA");
  if (folder == nullptr || *folder == '\0') return std::nullopt;
  return folder;
}

std::string missing_data(const std::string& name) {
  const auto folder = data_dir();
  if (!folder) return "LOOPBIT_DATA is not set; set it to the folder of real images.";
  const fs::path path = *folder / name;
  return fs::exists(path) ? "" : "LOOPBIT_DATA has no '" + name + "'.";
}

cv::Mat1b real_image(const std::string& path) {
  return cv::imread((data_dir().value() / path).string(), cv::IMREAD_GRAYSCALE);
}

cv::Mat1b real_image(const std::string& folder, std::size_t index) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(data_dir().value() / folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return real_image(folder + '/' + names.at(index));
}

void ScratchTest::SetUp() {
  std::string pattern = testing::TempDir() + "loopbit_XXXXXX";
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  root_ = pattern;
}

void ScratchTest::TearDown() { fs::remove_all(root_); }

std::string ScratchTest::write(const std::string& name, std::string_view text) const {
  fs::create_directories((root_ / name).parent_path());
  std::ofstream(root_ / name, std::ios::binary) << text;
  return path(name);
}

}  // namespace loopbit::test
