// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/surf.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include <dlib/image_keypoint/hessian_pyramid.h>
#include <dlib/image_keypoint/surf.h>
#include <dlib/opencv.h>
#include <opencv2/imgproc.hpp>

namespace loopbit {
namespace {

constexpr int kOctaves = 4;
constexpr int kIntervals = 6;
constexpr int kInitialStepPx = 2;
/// In dlib's unit of the Hessian's determinant, whose customary threshold is 30: noise alone.
constexpr double kMinResponse = 1.0;
/// A descriptor reaches this many scales from its keypoint: half of 20 samples, turned by up to 45
/// degrees, and half a Haar wavelet.
constexpr double kUprightReachScales = 11.0;
constexpr double kRotatedReachScales = 15.5;
constexpr double kDescriptorScale = 127.0 / 0.5;

using IntegralImage = dlib::integral_image_generic<long>;

cv::Mat1b working_image(const cv::Mat1b& gray, int working_side_px) {
  const double factor = static_cast<double>(working_side_px) / std::max(gray.cols, gray.rows);
  const cv::Size size(std::max(1, cvRound(gray.cols * factor)),
                      std::max(1, cvRound(gray.rows * factor)));
  if (size == gray.size()) return gray;
  cv::Mat resized;
  cv::resize(gray, resized, size, 0, 0, factor < 1 ? cv::INTER_AREA : cv::INTER_LINEAR_EXACT);
  return resized;
}

bool is_bright(const dlib::interest_point& point) { return point.laplacian < 0; }

auto rank(const dlib::interest_point& point) {
  return std::tuple(-point.score, point.center.y(), point.center.x(), point.scale);
}

/// The strongest keypoints whose descriptors lie within the image, dark ones first.
std::vector<dlib::interest_point> detect(const IntegralImage& integral,
                                         const SurfOptions& options) {
  dlib::hessian_pyramid pyramid;
  pyramid.build_pyramid(integral, kOctaves, kIntervals, kInitialStepPx);
  std::vector<dlib::interest_point> points;
  dlib::get_interest_points(pyramid, kMinResponse, points);

  const double reach_scales = options.upright ? kUprightReachScales : kRotatedReachScales;
  std::erase_if(points, [&](const dlib::interest_point& point) {
    const auto reach_px = static_cast<unsigned long>(std::ceil(reach_scales * point.scale)) + 2;
    return !dlib::get_rect(integral).contains(
        dlib::centered_rect(dlib::point(point.center), 2 * reach_px + 1, 2 * reach_px + 1));
  });
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return rank(a) < rank(b); });
  points.resize(std::min(points.size(), static_cast<std::size_t>(options.max_keypoints)));
  std::stable_partition(points.begin(), points.end(), std::not_fn(is_bright));
  return points;
}

Descriptor quantize(const dlib::matrix<double, 64, 1>& values) {
  Descriptor descriptor{};
  std::transform(values.begin(), values.end(), descriptor.begin(), [](double value) {
    return static_cast<std::int8_t>(
        std::clamp(std::round(value * kDescriptorScale), -127.0, 127.0));
  });
  return descriptor;
}

void describe(const IntegralImage& integral, const dlib::interest_point& point, bool upright,
              Features& features) {
  const double angle =
      upright ? 0.0 : dlib::compute_dominant_angle(integral, point.center, point.scale);
  dlib::matrix<double, 64, 1> values;
  dlib::compute_surf_descriptor(integral, point.center, point.scale, angle, values);
  features.descriptors.push_back(quantize(values));
  features.keypoints.push_back({static_cast<float>(point.center.x()),
                                static_cast<float>(point.center.y()),
                                static_cast<float>(point.scale), static_cast<float>(angle)});
}

}  // namespace

Features extract_surf(const cv::Mat1b& gray, const SurfOptions& options) {
  validate(options, "surf");
  const cv::Mat1b image = working_image(gray, options.working_side_px);
  IntegralImage integral;
  integral.load(dlib::cv_image<unsigned char>(static_cast<const cv::Mat&>(image)));
  const auto points = detect(integral, options);

  Features features;
  features.working_size_px = image.size();
  features.num_dark =
      static_cast<std::size_t>(std::count_if(points.begin(), points.end(), std::not_fn(is_bright)));
  features.keypoints.reserve(points.size());
  features.descriptors.reserve(points.size());
  for (const auto& point : points) describe(integral, point, options.upright, features);
  return features;
}

}  // namespace loopbit
