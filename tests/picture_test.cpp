// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/picture.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/picture_jpeg.hpp"

#include "test_support.hpp"

namespace loopbit::test {
namespace {

TEST(Picture, IsHalvedUntilItsLongSideIsBelow512) {
  const auto size_of = [](int width, int height) {
    return halved_to_picture(cv::Mat1b::zeros(height, width)).size();
  };
  EXPECT_EQ(size_of(511, 300), cv::Size(511, 300));
  EXPECT_EQ(size_of(512, 300), cv::Size(256, 150));
  EXPECT_EQ(size_of(1241, 376), cv::Size(310, 94));
  EXPECT_EQ(size_of(480, 640), cv::Size(240, 320));
  EXPECT_EQ(size_of(2049, 1), cv::Size(2049, 1));  // no row is left to halve
}

TEST(Picture, HalvingTakesTheMeanOfTwoByTwo) {
  const cv::Mat1b image = textured_image({641, 481}, 3);
  const cv::Mat1b half = halved_to_picture(image);
  ASSERT_EQ(half.size(), cv::Size(320, 240));
  for (int y = 0; y < half.rows; ++y) {
    for (int x = 0; x < half.cols; ++x) {
      const double mean = cv::mean(image(cv::Rect(2 * x, 2 * y, 2, 2)))[0];
      ASSERT_NEAR(half(y, x), mean, 0.51) << x << ", " << y;
    }
  }
}

TEST(Picture, ASmallImageIsCopied) {
  cv::Mat1b image(100, 100, uchar{9});
  const cv::Mat copy = halved_to_picture(image);
  image.setTo(1);
  EXPECT_EQ(copy.at<uchar>(50, 50), 9);
  EXPECT_TRUE(halved_to_picture(cv::Mat()).empty());
}

TEST(Picture, JpegShowsAnyCameraImage) {
  const cv::Mat1b grey = textured_image({752, 480}, 5);
  cv::Mat sixteen_bit;
  grey.convertTo(sixteen_bit, CV_16U, 257.0);
  cv::Mat twelve_bit;
  grey.convertTo(twelve_bit, CV_16U, 16.0);
  cv::Mat sixteen_bit_colour;
  cv::cvtColor(twelve_bit, sixteen_bit_colour, cv::COLOR_GRAY2BGRA);
  cv::Mat colour;
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGRA);
  cv::Mat expected;
  cv::resize(grey, expected, {256, 163}, 0, 0, cv::INTER_AREA);
  for (const cv::Mat& image :
       {cv::Mat(grey), sixteen_bit, twelve_bit, sixteen_bit_colour, colour}) {
    const cv::Mat shown = cv::imdecode(picture_jpeg(image), cv::IMREAD_GRAYSCALE);
    ASSERT_EQ(shown.size(), expected.size());
    EXPECT_LT(cv::norm(shown, expected, cv::NORM_L1) / 256 / 163, 5.0);
  }
  EXPECT_EQ(cv::imdecode(picture_jpeg(grey({0, 0, 100, 50})), cv::IMREAD_COLOR).size(),
            cv::Size(100, 50));
}

}  // namespace
}  // namespace loopbit::test
