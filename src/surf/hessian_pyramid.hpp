// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "integral_image.hpp"

namespace loopbit {

/// A sample of the pyramid that is larger than its 26 neighbours.
struct Maximum {
  float response = 0;
  std::uint16_t x = 0;  ///< in samples of its octave
  std::uint16_t y = 0;
  std::uint8_t octave = 0;
  std::uint8_t interval = 0;
};

/// A maximum's place and scale between the samples.
struct BlobCenter {
  double x_px = 0;
  double y_px = 0;
  double scale = 0;  ///< 1 = a 9 x 9 box filter
};

/// The determinant of the Hessian by box filters: 4 octaves of 4 intervals, sampled at every 2, 4,
/// 8 and 16 pixels (Bay et al. 2008, section 3). The lobe of interval i in octave o is 2^(o+1)
/// (i+1) + 1 px wide, so an octave's first two intervals are samples of the octave below.
class HessianPyramid {
 public:
  static constexpr int kOctaves = 4;
  static constexpr int kIntervals = 4;

  static constexpr int step_px(int octave) { return 2 << octave; }
  static constexpr int lobe_px(int octave, int interval) {
    return (2 << octave) * (interval + 1) + 1;
  }

  /// `integral` must outlive what is asked of the pyramid.
  void build(const IntegralImage& integral, const SurfKernels& kernels);

  /// Appends the maxima whose response is above `min_response`, of the two middle intervals.
  /// Of equal neighbours, the first is one.
  void find_maxima(float min_response, const SurfKernels& kernels, std::vector<Maximum>& maxima);

  /// By a quadric through the 27 samples (Brown and Lowe, BMVC 2002); nothing if its peak is not
  /// nearest to the sample.
  [[nodiscard]] std::optional<BlobCenter> refined(const Maximum& maximum) const;

  /// The sign of the Laplacian: bright blobs on dark ground have a negative one.
  [[nodiscard]] bool is_bright(const Maximum& maximum) const;

  [[nodiscard]] float response(int octave, int interval, int x, int y) const {
    return octaves_[static_cast<std::size_t>(octave)].row(interval, y)[x];
  }

  /// The samples at which a layer's filter lies within the image.
  [[nodiscard]] cv::Rect valid_samples(int octave, int interval) const;

 private:
  struct Octave {
    cv::Size samples;
    std::array<cv::Mat1f, kIntervals> layers;  ///< padded; rows begin at cache lines

    [[nodiscard]] const float* row(int interval, int y) const {
      return layers[static_cast<std::size_t>(interval)][y];
    }
    [[nodiscard]] float* row(int interval, int y) {
      return layers[static_cast<std::size_t>(interval)][y];
    }
  };

  void compute(int begin, std::ptrdiff_t count, int octave, int first_interval,
               const SurfKernels& kernels);
  void take_from_below(int octave, int interval);
  void append_marked(int octave, int interval, int y, std::vector<Maximum>& maxima) const;
  [[nodiscard]] bool equals_earlier_neighbour(int octave, int interval, int x, int y) const;

  const IntegralImage* integral_ = nullptr;
  std::array<Octave, kOctaves> octaves_;
  std::vector<std::uint8_t> is_maximum_;
};

}  // namespace loopbit
