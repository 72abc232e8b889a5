// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/gray_image.hpp"

#include <algorithm>
#include <utility>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

int minimum(const cv::Mat1b& image) { return *std::min_element(image.begin(), image.end()); }
int maximum(const cv::Mat1b& image) { return *std::max_element(image.begin(), image.end()); }

double max_difference(const cv::Mat1b& a, const cv::Mat1b& b) {
  return cv::norm(a, b, cv::NORM_INF);
}

/// A 12-bit camera's picture in the lower part of 16 bits: levels 200 to 3800, evenly spread.
cv::Mat1w twelve_bit_image() {
  cv::Mat1w image(60, 100);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image(y, x) = static_cast<std::uint16_t>(200 + 3600 * (y * image.cols + x) / 5999);
    }
  }
  return image;
}

TEST(GrayImage, PassesGreyWithoutCopy) {
  const cv::Mat1b image = textured_image({50, 40}, 1);
  const cv::Mat1b gray = gray_image(image);
  EXPECT_EQ(gray.data, image.data);
  EXPECT_EQ(gray.size(), image.size());
}

TEST(GrayImage, PassesPartOfAGreyImageWithoutCopy) {
  const cv::Mat1b image = textured_image({90, 80}, 1);
  const cv::Mat1b part = image(cv::Rect(7, 5, 51, 43));
  const cv::Mat1b gray = gray_image(part);
  EXPECT_EQ(gray.data, part.data);
  EXPECT_EQ(max_difference(gray, part), 0);
}

TEST(GrayImage, WeighsColoursAsBgr) {
  const cv::Size size(32, 32);
  EXPECT_EQ(gray_image(cv::Mat(size, CV_8UC3, cv::Scalar(255, 0, 0)))(5, 5), 29);
  EXPECT_EQ(gray_image(cv::Mat(size, CV_8UC3, cv::Scalar(0, 255, 0)))(5, 5), 150);
  EXPECT_EQ(gray_image(cv::Mat(size, CV_8UC3, cv::Scalar(0, 0, 255)))(5, 5), 76);
}

TEST(GrayImage, IgnoresTransparency) {
  const cv::Size size(32, 32);
  EXPECT_EQ(gray_image(cv::Mat(size, CV_8UC4, cv::Scalar(0, 255, 0, 0)))(5, 5), 150);
  EXPECT_EQ(gray_image(cv::Mat(size, CV_8UC4, cv::Scalar(0, 255, 0, 255)))(5, 5), 150);
}

TEST(GrayImage, ReadsPartOfAColourImage) {
  const cv::Mat1b texture = textured_image({90, 80}, 2);
  cv::Mat colour;
  cv::cvtColor(texture, colour, cv::COLOR_GRAY2BGR);
  const cv::Rect part(11, 3, 40, 50);
  EXPECT_EQ(max_difference(gray_image(colour(part)), texture(part)), 0);
}

TEST(GrayImage, StretchesTwelveBitsToEight) {
  const cv::Mat1w image = twelve_bit_image();
  const cv::Mat1b gray = gray_image(image);
  EXPECT_EQ(minimum(gray), 0);
  EXPECT_EQ(maximum(gray), 255);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      // Exact but for the thousandth cut off at either end and for rounding down.
      ASSERT_NEAR(gray(y, x), (image(y, x) - 200) * 255.0 / 3600, 1.5);
    }
  }
}

TEST(GrayImage, HotAndDeadPixelsDoNotCrushContrast) {
  cv::Mat1w image = twelve_bit_image();
  const cv::Mat1b clean = gray_image(image);
  image(30, 50) = 65535;
  image(20, 10) = 0;
  const cv::Mat1b gray = gray_image(image);
  EXPECT_EQ(gray(30, 50), 255);
  EXPECT_EQ(gray(20, 10), 0);
  cv::Mat1b elsewhere(image.size(), 255);
  elsewhere(30, 50) = elsewhere(20, 10) = 0;
  EXPECT_LE(cv::norm(gray, clean, cv::NORM_INF, elsewhere), 1);
}

TEST(GrayImage, OneHotPixelIsCutOffInTheSmallestImage) {
  cv::Mat1w image(32, 32, std::uint16_t{1000});
  image.colRange(0, 16).setTo(2000);
  image(20, 20) = 65535;
  const cv::Mat1b gray = gray_image(image);
  EXPECT_EQ(gray(0, 0), 255);
  EXPECT_EQ(gray(0, 31), 0);
}

TEST(GrayImage, StretchesPartOfASixteenBitImageByItself) {
  cv::Mat1w image(100, 140, std::uint16_t{50000});
  const cv::Rect part(20, 30, 100, 60);
  twelve_bit_image().copyTo(image(part));
  EXPECT_EQ(max_difference(gray_image(image(part)), gray_image(twelve_bit_image())), 0);
}

TEST(GrayImage, StretchesSixteenBitColour) {
  cv::Mat colour;
  cv::cvtColor(twelve_bit_image(), colour, cv::COLOR_GRAY2BGR);
  EXPECT_LE(max_difference(gray_image(colour), gray_image(twelve_bit_image())), 1);
  cv::cvtColor(twelve_bit_image(), colour, cv::COLOR_GRAY2BGRA);
  EXPECT_LE(max_difference(gray_image(colour), gray_image(twelve_bit_image())), 1);
}

TEST(GrayImage, ConstantSixteenBitImageStaysConstant) {
  for (const int level : {0, 1234, 65535}) {
    const cv::Mat1b gray = gray_image(cv::Mat(40, 40, CV_16UC1, cv::Scalar(level)));
    EXPECT_EQ(minimum(gray), maximum(gray)) << level;
  }
}

TEST(GrayImage, SmallestSideIs32) {
  EXPECT_EQ(gray_image(textured_image({32, 32}, 3)).size(), cv::Size(32, 32));
  for (const cv::Size size : {cv::Size(31, 31), cv::Size(31, 500), cv::Size(500, 31)}) {
    expect_error(ErrorKind::input,
                 {std::to_string(size.width) + " x " + std::to_string(size.height), "32 x 32"},
                 [&] { gray_image(cv::Mat1b(size, 9)); });
  }
}

TEST(GrayImage, RefusesAnEmptyImage) {
  expect_error(ErrorKind::input, {"empty", "32 x 32"}, [] { gray_image(cv::Mat()); });
}

TEST(GrayImage, RefusesOtherTypesByName) {
  for (const auto& [type, name] : {std::pair{CV_32FC1, "CV_32FC1"},
                                   {CV_64FC3, "CV_64FC3"},
                                   {CV_8SC1, "CV_8SC1"},
                                   {CV_16SC1, "CV_16SC1"},
                                   {CV_8UC2, "CV_8UC2"},
                                   {CV_16UC(5), "CV_16UC5"}}) {
    expect_error(ErrorKind::input, {name, "8 or 16 bits", "BGR"},
                 [type = type] { gray_image(cv::Mat::zeros(40, 40, type)); });
  }
}

TEST(GrayImage, RefusesMoreThanTwoDimensions) {
  const int sizes[] = {40, 40, 40};
  expect_error(ErrorKind::input, {"3 dimensions"}, [&] { gray_image(cv::Mat(3, sizes, CV_8UC1)); });
}

}  // namespace
}  // namespace loopbit::test
