// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/camera_file.hpp"
#include "loopbit/relative_pose.hpp"

#include "bindings.hpp"
#include "numpy_image.hpp"
#include "numpy_matrix.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

/// Shares the memory of `depth_m` if its rows are contiguous; valid as long as `depth_m`.
cv::Mat1f to_depth(py::array& depth_m) {
  if (depth_m.dtype().kind() != 'f') {
    throw py::type_error(fmt::format(
        "match_depth_m has dtype {}, but must be floats, in metres; 0 or nan = unknown.",
        std::string(py::str(depth_m.dtype()))));
  }
  if (depth_m.ndim() != 2) {
    throw py::value_error(
        fmt::format("match_depth_m has {} dimensions, but must have 2.", depth_m.ndim()));
  }
  auto floats = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(depth_m);
  if (!floats) throw py::error_already_set();
  depth_m = floats;
  return {static_cast<int>(floats.shape(0)), static_cast<int>(floats.shape(1)),
          floats.mutable_data()};
}

RelativePose relative_pose(const Features& query, const Features& match, const CameraModel& camera,
                           std::optional<py::array> match_depth_m,
                           const std::optional<CameraModel>& match_camera,
                           const RelativePoseOptions& options) {
  const cv::Mat1f depth_m = match_depth_m ? to_depth(*match_depth_m) : cv::Mat1f();
  const WithoutGil release;
  return RelativePoseEstimator(options).estimate(
      {.query = {&query, &camera},
       .match = {&match, match_camera ? &*match_camera : &camera},
       .match_depth_m = match_depth_m ? &depth_m : nullptr});
}

void bind_camera(py::module_& module) {
  py::class_<CameraModel>(module, "CameraModel",
                          "A calibrated camera. Its frame is x right, y down, z forward. Pixel "
                          "(0, 0) is the centre of the upper left pixel.")
      .def_property_readonly(
          "lens", [](const CameraModel& self) { return to_string(self.lens); },
          "'pinhole', 'radial_tangential' or 'equidistant'.")
      .def_property_readonly(
          "size_px",
          [](const CameraModel& self) {
            return std::pair(self.size_px.width, self.size_px.height);
          },
          "(width, height) of the calibrated images; (0, 0) if the file does not say.")
      .def_readonly("fx", &CameraModel::fx)
      .def_readonly("fy", &CameraModel::fy)
      .def_readonly("cx", &CameraModel::cx)
      .def_readonly("cy", &CameraModel::cy)
      .def_property_readonly(
          "distortion",
          [](const CameraModel& self) {
            return std::vector<double>(self.distortion.begin(), self.distortion.end());
          },
          "Eight numbers. radial_tangential: k1 k2 p1 p2 k3 k4 k5 k6. equidistant: k1 k2 k3 k4, "
          "then 0.")
      .def("__repr__", [](const CameraModel& self) {
        return fmt::format(
            "CameraModel({}, {} x {} px, fx={:.6g}, fy={:.6g}, cx={:.6g}, cy={:.6g})",
            to_string(self.lens), self.size_px.width, self.size_px.height, self.fx, self.fy,
            self.cx, self.cy);
      });
  module.def(
      "read_cameras", [](const std::filesystem::path& path) { return read_cameras(path.string()); },
      py::arg("path"), py::call_guard<WithoutGil>(),
      "The cameras in a calibration file of EuRoC, Kalibr, ROS, OpenCV or KITTI odometry, in the "
      "order of the file.");
}

void bind_pose(py::module_& module) {
  py::enum_<PoseStatus> status(module, "PoseStatus", "What came of the estimate of a pose.");
  for (const PoseStatus each : kAllPoseStatuses) status.value(to_string(each).data(), each);
  py::enum_<PoseKnown> known(module, "PoseKnown", "How much of a relative pose is known.");
  for (const PoseKnown each :
       {PoseKnown::nothing, PoseKnown::rotation, PoseKnown::direction, PoseKnown::metric}) {
    known.value(to_string(each).data(), each);
  }
  py::class_<RelativePose>(module, "RelativePose",
                           "The pose of the query's camera in the frame of the match's camera.")
      .def_readonly("status", &RelativePose::status)
      .def_readonly("known", &RelativePose::known)
      .def_property_readonly(
          "T_match_query", [](const RelativePose& self) { return square_of(self.T_match_query); },
          "4 x 4: x_match = T_match_query x_query. The translation is in metres if known is "
          "metric, "
          "has length 1 if only its direction is known, and is 0 below that.")
      .def_property_readonly(
          "covariance", [](const RelativePose& self) { return square_of(self.covariance); },
          "6 x 6, of a small motion (x, y, z, rx, ry, rz) in the frame of the query's camera, in "
          "metres and radians. If only the direction is known, positions are in units of the "
          "unknown length.")
      .def_readonly("matches", &RelativePose::matches)
      .def_property_readonly(
          "inliers", [](const RelativePose& self) { return take(self.inliers); },
          "The matches that the pose explains, as a structured array of query and place.")
      .def_readonly("points", &RelativePose::points, "Inliers whose depth is known.")
      .def_readonly("rms_px", &RelativePose::rms_px,
                    "Of the inliers' residuals, in pixels of the working image.")
      .def("to_g2o_edge", py::overload_cast<const RelativePose&, int, int>(&to_g2o_edge),
           whole("match"), whole("query"),
           "A line EDGE_SE3:QUAT with the information matrix as g2o defines it. What is not known "
           "has no information.")
      .def("__repr__", [](const RelativePose& self) {
        return fmt::format("RelativePose({}, known={}, inliers={})", to_string(self.status),
                           to_string(self.known), self.inliers.size());
      });
  module.def(
      "relative_pose", &relative_pose, py::arg("query"), py::arg("match"), py::arg("camera"),
      py::kw_only(), py::arg("match_depth_m") = py::none(), py::arg("match_camera") = py::none(),
      py::arg_v("options", RelativePoseOptions{}, "RelativePoseOptions()"),
      "Measures the relative pose of two images from their features. Without depth it knows "
      "the rotation and the direction of the translation. match_depth_m: metres along z for "
      "each pixel of the match, of any resolution, 0 or nan if unknown. match_camera: if the "
      "match was taken by another camera.");
}

}  // namespace

void bind_relative_poses(py::module_& module) {
  bind_settings<RelativePoseOptions>(module, "RelativePoseOptions", "relative_pose",
                                     "Settings of relative_pose().");
  bind_camera(module);
  bind_pose(module);
}

}  // namespace loopbit::python
