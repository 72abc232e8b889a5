// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "right_images.hpp"

#include <fmt/format.h>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/image_source.hpp"

#include "image_names.hpp"

namespace loopbit {
namespace {

Error unknown_pose(const std::string& folder, const std::string& why) {
  return {ErrorKind::input,
          fmt::format("It is not known how the camera of '{}' stands to the first ({}); give the "
                      "baseline of a rectified pair, or a calibration with both cameras.",
                      folder, why)};
}

CameraModel calibration_of(const std::string& folder, const std::string& left_file) {
  if (const auto found = find_camera(folder)) return read_camera(found->path, found->index);
  const auto cameras = read_cameras(left_file);
  if (cameras.size() >= 2) return cameras[1];
  throw unknown_pose(folder, fmt::format("'{}' has one camera", left_file));
}

}  // namespace

RightCamera right_camera(const std::string& folder, double baseline_m, const CameraModel& left,
                         const std::string& left_file) {
  RightCamera right{.camera = left};
  if (baseline_m > 0) {
    right.T_left_right(0, 3) = baseline_m;
    return right;
  }
  right.camera = calibration_of(folder, left_file);
  if (!left.T_body_camera || !right.camera.T_body_camera) {
    throw unknown_pose(folder, "the calibration has no extrinsics");
  }
  right.T_left_right = left.T_body_camera->inv() * *right.camera.T_body_camera;
  return right;
}

RightImages::RightImages(const std::string& folder, const RightCamera& right,
                         const SurfOptions& options)
    : right_(right), by_stem_(images_by_stem(folder, "right images")), surf_(options) {
  if (by_stem_.empty()) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' has no images; give a folder of images named like those of the "
                            "run.",
                            folder));
  }
  const cv::Size size_px = images::read_image_file(by_stem_.begin()->second, kMaxMegapixels).size();
  check_size(right_.camera, fmt::format("The right camera of '{}'", folder), size_px);
  right_.camera.size_px = size_px;
}

Features RightImages::features_of(const std::string& name) {
  Features features;
  const auto found = by_stem_.find(std::filesystem::path(name).stem().string());
  if (found == by_stem_.end()) return features;
  try {
    const cv::Mat image = images::read_image_file(found->second, kMaxMegapixels);
    if (image.size() == right_.camera.size_px) surf_.extract(gray_image(image), features);
  } catch (const Error&) {  // one of many: its loops have the scale no_depth
    return {};
  }
  return features;
}

}  // namespace loopbit
