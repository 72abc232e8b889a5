// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "surf_peers.hpp"

#include <algorithm>
#include <cmath>

#include <dlib/image_keypoint/hessian_pyramid.h>
#include <dlib/image_keypoint/surf.h>
#include <dlib/opencv.h>

namespace loopbit::bench {
namespace {

using IntegralImage = dlib::integral_image_generic<long>;

std::vector<dlib::interest_point> detect(const IntegralImage& integral, int max_keypoints,
                                         bool upright) {
  dlib::hessian_pyramid pyramid;
  pyramid.build_pyramid(integral, 4, 6, 2);  // as dlib::get_surf_points does
  std::vector<dlib::interest_point> points;
  dlib::get_interest_points(pyramid, 1.0, points);
  const double reach_scales = upright ? 11.0 : 15.5;
  std::erase_if(points, [&](const dlib::interest_point& point) {
    const auto side = 2 * static_cast<unsigned long>(std::ceil(reach_scales * point.scale) + 2) + 1;
    return !dlib::get_rect(integral).contains(
        dlib::centered_rect(dlib::point(point.center), side, side));
  });
  const auto count = std::min(points.size(), static_cast<std::size_t>(max_keypoints));
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.score > b.score; });
  points.resize(count);
  std::stable_partition(points.begin(), points.end(),
                        [](const auto& point) { return point.laplacian >= 0; });
  return points;
}

}  // namespace

Features dlib_surf(const cv::Mat1b& gray, int max_keypoints, bool upright) {
  IntegralImage integral;
  integral.load(dlib::cv_image<unsigned char>(static_cast<const cv::Mat&>(gray)));
  Features features;
  features.working_size_px = gray.size();
  for (const auto& point : detect(integral, max_keypoints, upright)) {
    const double angle =
        upright ? 0.0 : dlib::compute_dominant_angle(integral, point.center, point.scale);
    dlib::matrix<double, 64, 1> values;
    dlib::compute_surf_descriptor(integral, point.center, point.scale, angle, values);
    Descriptor& descriptor = features.descriptors.emplace_back();
    std::transform(values.begin(), values.end(), descriptor.begin(), [](double value) {
      return static_cast<std::int8_t>(std::clamp(std::round(value * 254.0), -127.0, 127.0));
    });
    features.keypoints.push_back({static_cast<float>(point.center.x()),
                                  static_cast<float>(point.center.y()),
                                  static_cast<float>(point.scale), static_cast<float>(angle)});
    if (point.laplacian >= 0) ++features.num_dark;
  }
  return features;
}

}  // namespace loopbit::bench
