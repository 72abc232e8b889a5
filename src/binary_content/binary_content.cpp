// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/binary_content.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "loopbit/gray_image.hpp"
#include "loopbit/image_shrinker.hpp"

namespace loopbit {
namespace {

/// A frequency whose amplitude is below this (in grey levels summed over the 64 x 64 map) is
/// rounding noise, not structure: it has no phase worth keeping.
constexpr float kNoiseAmplitude = 1.0F;

/// In whole grey levels.
cv::Mat1f resize_to_map(const cv::Mat1b& gray) {
  const cv::Size size(kContentSide, kContentSide);
  cv::Mat1b small;
  if (gray.cols >= kContentSide && gray.rows >= kContentSide) {
    ImageShrinker().shrink(gray, size, small);
  } else {
    cv::resize(gray, small, size, 0, 0, cv::INTER_LINEAR_EXACT);
  }
  cv::Mat1f map;
  small.convertTo(map, CV_32F);
  return map;
}

/// Plain loops in a fixed order, because OpenCV's filters round differently from one instruction
/// set to the next, and the bits may not.
cv::Mat1f filter_columns_then_transpose(const cv::Mat1f& padded, const std::vector<float>& kernel) {
  const int taps = static_cast<int>(kernel.size());
  cv::Mat1f transposed(padded.cols, padded.rows - taps + 1);
  std::vector<float> sums(static_cast<std::size_t>(padded.cols));
  for (int y = 0; y < transposed.cols; ++y) {
    std::fill(sums.begin(), sums.end(), 0.0F);
    for (int k = 0; k < taps; ++k) {
      const float* row = padded[y + k];
      const float weight = kernel[static_cast<std::size_t>(k)];
      for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += weight * row[x];
    }
    for (int x = 0; x < transposed.rows; ++x) transposed(x, y) = sums[static_cast<std::size_t>(x)];
  }
  return transposed;
}

cv::Mat1f separable_filter(const cv::Mat1f& map, const std::vector<float>& kernel, int border) {
  const int radius = static_cast<int>(kernel.size()) / 2;
  cv::Mat1f padded;
  cv::copyMakeBorder(map, padded, radius, radius, radius, radius, border);
  return filter_columns_then_transpose(filter_columns_then_transpose(padded, kernel), kernel);
}

std::vector<float> box_kernel(int radius) {
  const int side = 2 * radius + 1;
  return std::vector<float>(static_cast<std::size_t>(side), 1.0F / static_cast<float>(side));
}

std::vector<float> gaussian_kernel(double sigma) {
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> weights;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    weights.push_back(std::exp(-i * i / (2 * sigma * sigma)));
    sum += weights.back();
  }
  std::vector<float> kernel;
  kernel.reserve(weights.size());
  for (const double weight : weights) kernel.push_back(static_cast<float>(weight / sum));
  return kernel;
}

cv::Mat1f log_amplitude(const cv::Mat2f& spectrum) {
  cv::Mat1f log_amplitude(spectrum.size());
  std::transform(spectrum.begin(), spectrum.end(), log_amplitude.begin(), [](const cv::Vec2f& f) {
    return std::log(std::max(std::sqrt(f[0] * f[0] + f[1] * f[1]), kNoiseAmplitude));
  });
  return log_amplitude;
}

/// exp(R + iP) with R = L - box(L). As exp(L + iP) is the spectrum F itself, this is F /
/// exp(box(L)): no phase has to be computed.
cv::Mat2f residual_spectrum(const cv::Mat2f& spectrum, int radius) {
  const cv::Mat1f average =
      separable_filter(log_amplitude(spectrum), box_kernel(radius), cv::BORDER_WRAP);
  cv::Mat2f residual(spectrum.size());
  std::transform(spectrum.begin(), spectrum.end(), average.begin(), residual.begin(),
                 [](const cv::Vec2f& f, float mean_log) -> cv::Vec2f {
                   const float amplitude_sq = f[0] * f[0] + f[1] * f[1];
                   if (amplitude_sq < kNoiseAmplitude * kNoiseAmplitude) return {0.0F, 0.0F};
                   return f * std::exp(-mean_log);
                 });
  return residual;
}

template <typename Visit>
void for_each_pixel(const Visit& visit) {
  for (int y = 0; y < kContentSide; ++y) {
    for (int x = 0; x < kContentSide; ++x) visit(x, y);
  }
}

bool is_set(const BinaryContent& content, int x, int y) {
  return (content.rows[static_cast<std::size_t>(y)] >> static_cast<unsigned>(x) & 1U) != 0;
}

void set_pixel(BinaryContent& content, int x, int y) {
  content.rows[static_cast<std::size_t>(y)] |= std::uint64_t{1} << static_cast<unsigned>(x);
}

}  // namespace

cv::Mat1f saliency_map(const cv::Mat1b& gray, const BinaryContentOptions& options) {
  validate(options, "binary_content");
  check_size(gray);
  cv::Mat2f spectrum;
  cv::dft(resize_to_map(gray), spectrum, cv::DFT_COMPLEX_OUTPUT);
  const cv::Mat2f residual = residual_spectrum(spectrum, options.residual_radius_px);
  cv::Mat1f map;
  cv::dft(residual, map, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  cv::multiply(map, map, map);
  return separable_filter(map, gaussian_kernel(options.blur_sigma_px), cv::BORDER_REFLECT_101);
}

BinaryContent binarize(const cv::Mat1f& saliency, double gamma, const BinaryContent& excluded) {
  CV_Assert(saliency.rows == kContentSide && saliency.cols == kContentSide);
  double sum = 0;
  for_each_pixel([&](int x, int y) {
    if (!is_set(excluded, x, y)) sum += saliency(y, x);
  });
  const double threshold = gamma * sum / (kContentSide * kContentSide - count(excluded));
  BinaryContent content;
  for_each_pixel([&](int x, int y) {
    if (saliency(y, x) > threshold && !is_set(excluded, x, y)) set_pixel(content, x, y);
  });
  return content;
}

BinaryContent excluded_pixels(const cv::Mat1b& mask) {
  check_size(mask);
  cv::Mat1b is_used;  // 0 or 255
  cv::compare(mask, 0, is_used, cv::CMP_NE);
  const cv::Mat1f used = resize_to_map(is_used);
  BinaryContent excluded;
  for_each_pixel([&](int x, int y) {
    if (used(y, x) <= 128) set_pixel(excluded, x, y);  // half of 255, rounded
  });
  return excluded;
}

BinaryContent binary_content(const cv::Mat1b& gray, const BinaryContentOptions& options) {
  return binarize(saliency_map(gray, options), options.gamma);
}

}  // namespace loopbit
