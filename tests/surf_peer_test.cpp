// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The Hessian against dlib's, and the parts of SURF against their definitions.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <vector>

#include <dlib/image_keypoint/hessian_pyramid.h>
#include <dlib/opencv.h>
#include <gtest/gtest.h>

#include "loopbit/kernels_for.hpp"

#include "hessian_pyramid.hpp"
#include "integral_image.hpp"
#include "patch.hpp"
#include "surf_kernels.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

class EveryKernel : public testing::TestWithParam<InstructionSet> {
 protected:
  [[nodiscard]] static const SurfKernels& kernels() { return kernels_for<SurfKernels>(GetParam()); }
};

TEST_P(EveryKernel, LinearRowsLieBetweenFourPixels) {
  Random random(3);
  for (const int width : {1, 2, 17, 300}) {
    const cv::Mat1b rows = textured_image({width, 2}, 4);
    constexpr std::size_t kCount = 100;
    std::array<std::int32_t, kCount> columns{};
    std::array<std::int32_t, kCount> right_weights{};
    for (std::size_t i = 0; i < kCount; ++i) {
      columns.at(i) = random.between(0, width - 1);
      right_weights.at(i) = random.between(0, 256);
    }
    for (const std::int32_t lower_weight : {0, 1, 77, 256}) {
      const LinearRow from{rows[0],        rows[1],
                           lower_weight,   static_cast<std::uint32_t>(width),
                           columns.data(), right_weights.data()};
      std::vector<std::uint16_t> blended(static_cast<std::size_t>(width) + 1);
      std::vector<std::uint32_t> pairs(blended.size());
      std::array<std::uint8_t, kCount> pixels{};
      kernels().linear_row(from, kCount, blended.data(), pairs.data(), pixels.data());
      for (std::size_t i = 0; i < kCount; ++i) {
        const int next = std::min(columns.at(i) + 1, width - 1);
        const double down = lower_weight / 256.0;
        const double right = right_weights.at(i) / 256.0;
        const auto between = [&](int x) { return rows(0, x) * (1 - down) + rows(1, x) * down; };
        const double expected = between(columns.at(i)) * (1 - right) + between(next) * right;
        EXPECT_NEAR(pixels.at(i), expected, 0.5) << width << ' ' << i;
      }
    }
  }
}

TEST_P(EveryKernel, IntegralImageSumsBoxes) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(2, 3), cv::Size(31, 17), cv::Size(32, 16),
                              cv::Size(33, 40), cv::Size(201, 65)}) {
    const cv::Mat1b gray = textured_image(size, 3);
    IntegralImage integral;
    integral.load(gray, kernels());
    for (int y = 0; y <= size.height; ++y) {
      for (int x = 0; x <= size.width; ++x) {
        const int expected = static_cast<int>(cv::sum(gray(cv::Rect(0, 0, x, y)))[0]);
        ASSERT_EQ(integral.box(0, 0, x, y), expected) << size << ' ' << x << ' ' << y;
      }
    }
  }
}

TEST(IntegralImage, SumsPartsOfPixels) {
  const cv::Mat1b gray = (cv::Mat1b(2, 3) << 1, 2, 4, 8, 16, 32);
  IntegralImage integral;
  integral.load(gray, kernels_for<SurfKernels>(active_instruction_set()));
  EXPECT_DOUBLE_EQ(integral.sum_before(3, 2), 63);
  EXPECT_DOUBLE_EQ(integral.sum_before(0.5, 0.25), 0.5 * 0.25 * 1);
  EXPECT_DOUBLE_EQ(integral.sum_before(1.75, 1.5), 1 + 0.75 * 2 + 0.5 * (8 + 0.75 * 16));
  EXPECT_DOUBLE_EQ(integral.sum_before(-1, 1), 0);
  EXPECT_DOUBLE_EQ(integral.sum_before(9, 9), 63);
}

/// dlib computes with doubles, we with floats: by so much of the largest response do they differ.
constexpr double kTolerance = 1e-5;

void expect_layer_equals(const HessianPyramid& pyramid, const dlib::hessian_pyramid& peer,
                         int octave, int interval) {
  // dlib leaves a border free that is wider than the filter of the first octave needs.
  const int border = static_cast<int>(peer.get_border_size(interval));
  const cv::Rect all(border, border, static_cast<int>(peer.nc(octave)) - 2 * border,
                     static_cast<int>(peer.nr(octave)) - 2 * border);
  const cv::Rect both = pyramid.valid_samples(octave, interval) & all;
  for (int y = both.y; y < both.y + both.height; ++y) {
    for (int x = both.x; x < both.x + both.width; ++x) {
      const double expected = peer.get_value(octave, interval, y, x);
      ASSERT_NEAR(pyramid.response(octave, interval, x, y), expected, kTolerance * (expected + 1e4))
          << "octave " << octave << " interval " << interval << " at " << x << ' ' << y;
    }
  }
}

TEST_P(EveryKernel, ResponsesEqualDlibs) {
  for (const cv::Size size :
       {cv::Size(640, 480), cv::Size(301, 222), cv::Size(127, 300), cv::Size(64, 64)}) {
    const cv::Mat1b gray = textured_image(size, 4);
    dlib::integral_image_generic<long> peer_integral;
    peer_integral.load(dlib::cv_image<unsigned char>(static_cast<const cv::Mat&>(gray)));
    dlib::hessian_pyramid peer;
    peer.build_pyramid(peer_integral, HessianPyramid::kOctaves, HessianPyramid::kIntervals, 2);
    IntegralImage integral;
    integral.load(gray, kernels());
    HessianPyramid pyramid;
    pyramid.build(integral, kernels());
    for (int i = 0; i < HessianPyramid::kOctaves * HessianPyramid::kIntervals; ++i) {
      SCOPED_TRACE(size);
      expect_layer_equals(pyramid, peer, i / HessianPyramid::kIntervals,
                          i % HessianPyramid::kIntervals);
    }
  }
}

bool is_maximum(const HessianPyramid& pyramid, int octave, int interval, int x, int y) {
  const float here = pyramid.response(octave, interval, x, y);
  if (here <= 1.0F) return false;
  for (int k = 0; k < 27; ++k) {
    const float other =
        pyramid.response(octave, interval + k / 9 - 1, x + k % 3 - 1, y + k / 3 % 3 - 1);
    // Of equal ones, the first.
    if (k < 13 ? other >= here : other > here) return false;
  }
  return true;
}

TEST_P(EveryKernel, MaximaAreLargerThanTheirNeighbours) {
  const cv::Mat1b gray = textured_image({403, 301}, 5);
  IntegralImage integral;
  integral.load(gray, kernels());
  HessianPyramid pyramid;
  pyramid.build(integral, kernels());
  std::vector<cv::Vec4i> expected;
  for (int o = 0; o < HessianPyramid::kOctaves; ++o) {
    for (const int i : {1, 2}) {
      const cv::Rect valid = pyramid.valid_samples(o, i + 1);
      for (int k = 0; k < valid.area(); ++k) {
        const int x = valid.x + k % valid.width;
        const int y = valid.y + k / valid.width;
        const bool is_inner =
            x > valid.x && y > valid.y && x < valid.br().x - 1 && y < valid.br().y - 1;
        if (is_inner && is_maximum(pyramid, o, i, x, y)) expected.emplace_back(o, i, x, y);
      }
    }
  }
  std::vector<Maximum> maxima;
  pyramid.find_maxima(1.0F, kernels(), maxima);
  ASSERT_EQ(maxima.size(), expected.size());
  EXPECT_GT(expected.size(), 100U);
  for (std::size_t i = 0; i < maxima.size(); ++i) {
    const Maximum& m = maxima[i];
    EXPECT_EQ(cv::Vec4i(m.octave, m.interval, m.x, m.y), expected[i]);
    EXPECT_EQ(m.response, pyramid.response(m.octave, m.interval, m.x, m.y));
  }
}

TEST_P(EveryKernel, CellsAreMeans) {
  const cv::Mat1b gray = textured_image({300, 200}, 6);
  IntegralImage integral;
  integral.load(gray, kernels());
  Patch patch{};
  // With an even scale and a centre on a pixel, all cells have the same size.
  upright_patch(integral, {.x_px = 150, .y_px = 100, .scale = 4}, kernels(), patch);
  for (int i = 0; i < static_cast<int>(kPatchCells); ++i) {
    for (int k = 0; k < static_cast<int>(kPatchCells); ++k) {
      const cv::Rect cell(150 - 42 + 1 + 4 * k, 100 - 42 + 1 + 4 * i, 4, 4);
      EXPECT_NEAR(patch[static_cast<std::size_t>(i) * kCellStride + static_cast<std::size_t>(k)],
                  cv::mean(gray(cell))[0], 1e-3)
          << i << ' ' << k;
    }
  }
}

TEST_P(EveryKernel, DescribesAFlatPatchByZeros) {
  const Patch flat = [] {
    Patch patch{};
    patch.fill(77.0F);
    return patch;
  }();
  Descriptor descriptor{};
  descriptor.fill(5);
  kernels().describe(flat.data(), descriptor.data());
  EXPECT_EQ(descriptor, Descriptor{});
}

using Values = std::array<double, kDescriptorSize>;

/// How much a sample counts in a bin along one axis.
double bin_weight(int sample, int bin) {
  constexpr std::array kAwayFromMiddle = {1.0, 4.0 / 5, 4.0 / 6, 4.0 / 7};
  const int away = std::abs(sample - (5 * bin + 2));
  return away > 3 ? 0.0 : kAwayFromMiddle.at(static_cast<std::size_t>(away));
}

/// Sample by sample, in doubles.
Values slow_descriptor(const Patch& cells) {
  Values values{};
  const auto cell = [&](int y, int x) {
    return double{cells[static_cast<std::size_t>(y) * kCellStride + static_cast<std::size_t>(x)]};
  };
  for (int k = 0; k < 20 * 20 * 16; ++k) {
    const int y = k / 16 / 20;
    const int x = k / 16 % 20;
    const int bin_y = k % 16 / 4;
    const int bin_x = k % 4;
    const double weight = bin_weight(y, bin_y) * bin_weight(x, bin_x);
    const double dx = cell(y, x + 1) + cell(y + 1, x + 1) - cell(y, x) - cell(y + 1, x);
    const double dy = cell(y + 1, x) + cell(y + 1, x + 1) - cell(y, x) - cell(y, x + 1);
    const std::array sums = {dx, dy, std::abs(dx), std::abs(dy)};
    for (std::size_t kind = 0; kind < sums.size(); ++kind) {
      const auto bin = (static_cast<std::size_t>(4 * bin_y) + kind) * 4;
      values.at(bin + static_cast<std::size_t>(bin_x)) += weight * sums.at(kind);
    }
  }
  const double length =
      std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0));
  for (double& value : values) value *= 254 / length;
  return values;
}

TEST_P(EveryKernel, DescribesAsTheSlowWay) {
  const cv::Mat1b gray = textured_image({300, 200}, 7);
  IntegralImage integral;
  integral.load(gray, kernels());
  for (const float scale : {2.0F, 3.3F, 7.0F}) {
    Patch patch{};
    upright_patch(integral, {.x_px = 150, .y_px = 100, .scale = scale}, kernels(), patch);
    Descriptor descriptor{};
    kernels().describe(patch.data(), descriptor.data());
    const Values expected = slow_descriptor(patch);
    for (std::size_t i = 0; i < kDescriptorSize; ++i) {
      EXPECT_NEAR(descriptor.at(i), std::clamp(expected.at(i), -127.0, 127.0), 0.51) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Surf, EveryKernel, testing::ValuesIn(available_instruction_sets()),
                         [](const auto& set) { return std::string(to_string(set.param)); });

}  // namespace
}  // namespace loopbit::test
