// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The Hessian against dlib's, and the parts of SURF against their definitions.
#include <algorithm>
#include <cmath>
#include <vector>

#include <dlib/image_keypoint/hessian_pyramid.h>
#include <dlib/opencv.h>
#include <gtest/gtest.h>

#include "hessian_pyramid.hpp"
#include "integral_image.hpp"
#include "patch.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

class EveryKernel : public testing::TestWithParam<const Kernels*> {};

TEST_P(EveryKernel, IntegralImageSumsBoxes) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(2, 3), cv::Size(31, 17), cv::Size(32, 16),
                              cv::Size(33, 40), cv::Size(201, 65)}) {
    const cv::Mat1b gray = textured_image(size, 3);
    IntegralImage integral;
    integral.load(gray, *GetParam());
    for (int y = 0; y <= size.height; ++y) {
      for (int x = 0; x <= size.width; ++x) {
        const int expected = static_cast<int>(cv::sum(gray(cv::Rect(0, 0, x, y)))[0]);
        ASSERT_EQ(integral.box(0, 0, x, y), expected) << size << ' ' << x << ' ' << y;
      }
    }
  }
}

/// dlib computes with doubles, we with floats: by so much of the largest response do they differ.
constexpr double kTolerance = 1e-5;

TEST_P(EveryKernel, ResponsesEqualDlibs) {
  for (const cv::Size size :
       {cv::Size(640, 480), cv::Size(301, 222), cv::Size(127, 300), cv::Size(64, 64)}) {
    const cv::Mat1b gray = textured_image(size, 4);
    dlib::integral_image_generic<long> peer_integral;
    peer_integral.load(dlib::cv_image<unsigned char>(static_cast<const cv::Mat&>(gray)));
    dlib::hessian_pyramid peer;
    peer.build_pyramid(peer_integral, HessianPyramid::kOctaves, HessianPyramid::kIntervals, 2);
    IntegralImage integral;
    integral.load(gray, *GetParam());
    HessianPyramid pyramid;
    pyramid.build(integral, *GetParam());
    for (int o = 0; o < HessianPyramid::kOctaves; ++o) {
      for (int i = 0; i < HessianPyramid::kIntervals; ++i) {
        // dlib leaves a border free that is wider than the filter of the first octave needs.
        const int border = static_cast<int>(peer.get_border_size(i));
        const cv::Rect all(border, border, static_cast<int>(peer.nc(o)) - 2 * border,
                           static_cast<int>(peer.nr(o)) - 2 * border);
        const cv::Rect both = pyramid.valid_samples(o, i) & all;
        for (int y = both.y; y < both.y + both.height; ++y) {
          for (int x = both.x; x < both.x + both.width; ++x) {
            const double expected = peer.get_value(o, i, y, x);
            ASSERT_NEAR(pyramid.response(o, i, x, y), expected, kTolerance * (expected + 1e4))
                << size << " octave " << o << " interval " << i << " at " << x << ' ' << y;
          }
        }
      }
    }
  }
}

TEST_P(EveryKernel, MaximaAreLargerThanTheirNeighbours) {
  const cv::Mat1b gray = textured_image({403, 301}, 5);
  IntegralImage integral;
  integral.load(gray, *GetParam());
  HessianPyramid pyramid;
  pyramid.build(integral, *GetParam());
  std::vector<Maximum> maxima;
  pyramid.find_maxima(1.0F, *GetParam(), maxima);
  std::size_t expected = 0;
  for (int o = 0; o < HessianPyramid::kOctaves; ++o) {
    for (int i = 1; i + 1 < HessianPyramid::kIntervals; ++i) {
      const cv::Rect valid = pyramid.valid_samples(o, i + 1);
      for (int y = valid.y + 1; y < valid.y + valid.height - 1; ++y) {
        for (int x = valid.x + 1; x < valid.x + valid.width - 1; ++x) {
          const float here = pyramid.response(o, i, x, y);
          bool is_maximum = here > 1.0F;
          for (int k = 0; k < 27 && is_maximum; ++k) {
            const float other =
                pyramid.response(o, i + k / 9 - 1, x + k % 3 - 1, y + k / 3 % 3 - 1);
            // Of equal ones, the first.
            if (k != 13) is_maximum = k < 13 ? here > other : here >= other;
          }
          if (!is_maximum) continue;
          ASSERT_LT(expected, maxima.size());
          const Maximum& m = maxima[expected++];
          EXPECT_EQ(m.response, here);
          EXPECT_EQ(cv::Vec4i(m.octave, m.interval, m.x, m.y), cv::Vec4i(o, i, x, y));
        }
      }
    }
  }
  EXPECT_EQ(maxima.size(), expected);
  EXPECT_GT(expected, 100U);
}

TEST_P(EveryKernel, CellsAreMeans) {
  const cv::Mat1b gray = textured_image({300, 200}, 6);
  IntegralImage integral;
  integral.load(gray, *GetParam());
  Patch patch{};
  // With an even scale and a centre on a pixel, all cells have the same size.
  upright_patch(integral, {.x_px = 150, .y_px = 100, .scale = 4}, *GetParam(), patch);
  for (int i = 0; i < static_cast<int>(kCells); ++i) {
    for (int k = 0; k < static_cast<int>(kCells); ++k) {
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
  GetParam()->describe(flat.data(), descriptor.data());
  EXPECT_EQ(descriptor, Descriptor{});
}

INSTANTIATE_TEST_SUITE_P(Surf, EveryKernel,
                         testing::ValuesIn(available_kernels().begin(), available_kernels().end()),
                         [](const auto& kernels) { return std::string(kernels.param->name); });

}  // namespace
}  // namespace loopbit::test
