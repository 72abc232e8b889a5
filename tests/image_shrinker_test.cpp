// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/image_shrinker.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

cv::Mat1b shrunk(const cv::Mat1b& gray, cv::Size size,
                 InstructionSet set = active_instruction_set()) {
  cv::Mat1b small;
  ImageShrinker(set).shrink(gray, size, small);
  return small;
}

double largest_difference(const cv::Mat1b& a, const cv::Mat1b& b) {
  return cv::norm(a, b, cv::NORM_INF);
}

struct Sizes {
  cv::Size from;
  cv::Size to;
};

TEST(ImageShrinker, UpTo256PartsAreExact) {
  for (const auto& [from, to] :
       {Sizes{{64, 64}, {64, 64}}, Sizes{{65, 127}, {64, 64}}, Sizes{{640, 480}, {256, 192}},
        Sizes{{801, 333}, {17, 250}}, Sizes{{1000, 40}, {1, 1}}, Sizes{{300, 70}, {256, 1}}}) {
    const cv::Mat1b gray = textured_image(from, 9);
    for (const InstructionSet set : available_instruction_sets()) {
      EXPECT_EQ(largest_difference(shrunk(gray, to, set), area_means(gray, to)), 0)
          << from << " to " << to << ", " << to_string(set);
    }
  }
}

TEST(ImageShrinker, MorePartsEndAtFractionsOfPixels) {
  for (const auto& [from, to] : {Sizes{{1920, 1080}, {739, 416}}, Sizes{{1300, 700}, {257, 255}},
                                 Sizes{{701, 603}, {701, 602}}}) {
    const cv::Mat1b gray = textured_image(from, 5);
    const cv::Mat1b small = shrunk(gray, to);
    const cv::Mat1b exact = area_means(gray, to);
    EXPECT_LE(largest_difference(small, exact), 1) << from << " to " << to;
    EXPECT_LT(cv::norm(small, exact, cv::NORM_L1), 0.01 * to.area()) << from << " to " << to;
    cv::Mat1b by_opencv;
    cv::resize(gray, by_opencv, to, 0, 0, cv::INTER_AREA);
    EXPECT_LE(largest_difference(small, by_opencv), 1) << from << " to " << to;
  }
}

TEST(ImageShrinker, NoGreyLevelIsGainedOrLost) {
  for (const int level : {0, 1, 128, 255}) {
    const cv::Mat1b gray(517, 2003, static_cast<std::uint8_t>(level));
    for (const cv::Size size : {cv::Size(801, 207), cv::Size(300, 257), cv::Size(64, 64)}) {
      const cv::Mat1b small = shrunk(gray, size);
      EXPECT_EQ(largest_difference(small, cv::Mat1b(size, gray(0, 0))), 0) << level << ", " << size;
    }
  }
}

TEST(ImageShrinker, KeepsNothingOfTheImageBefore) {
  ImageShrinker shrinker;
  cv::Mat1b small;
  shrinker.shrink(textured_image({900, 700}, 1), {400, 300}, small);
  const cv::Mat1b next = textured_image({350, 450}, 2);
  shrinker.shrink(next, {170, 200}, small);
  EXPECT_EQ(largest_difference(small, shrunk(next, {170, 200})), 0);
}

}  // namespace
}  // namespace loopbit::test
