// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "loopbit/gray_image.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "bindings.hpp"
#include "numpy_image.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

void bind_feature_types(py::module_& module) {
  py::class_<Features>(module, "Features",
                       "The features of one image; keypoints[i] belongs to descriptors[i].")
      .def_property_readonly(
          "working_size_px",
          [](const Features& self) {
            return std::pair(self.working_size_px.width, self.working_size_px.height);
          },
          "(width, height) of the working image, pixels.")
      .def_property_readonly(
          "num_dark", [](const Features& self) { return self.num_dark; },
          "Number of dark blobs, which come first. Both groups are sorted by strength.")
      .def_property_readonly(
          "keypoints",
          [](const py::object& self) {
            const auto& keypoints = self.cast<const Features&>().keypoints;
            return view_of(keypoints.data(), {static_cast<py::ssize_t>(keypoints.size())}, self);
          },
          "Structured array of x_px, y_px, scale and angle_rad, float32, in pixels of the working "
          "image; read-only and not copied.")
      .def_property_readonly(
          "descriptors",
          [](const py::object& self) -> py::array_t<std::int8_t> {
            const auto& descriptors = self.cast<const Features&>().descriptors;
            const auto* values = descriptors.empty() ? nullptr : descriptors.front().data();
            return view_of(values, {static_cast<py::ssize_t>(descriptors.size()), kDescriptorSize},
                           self);
          },
          "int8, shape (n, 64), each of length 254; read-only and not copied.")
      .def("__len__", [](const Features& self) { return self.keypoints.size(); })
      .def("__repr__", [](const Features& self) {
        return fmt::format("Features({} of {} x {} px)", self.keypoints.size(),
                           self.working_size_px.width, self.working_size_px.height);
      });
  module.def(
      "extract_surf",
      [](ImageArgument image, const SurfOptions& options) {
        const cv::Mat pixels = to_image(image, "image");
        const WithoutGil release;
        return extract_surf(gray_image(pixels), options);
      },
      py::arg("image"), py::arg_v("options", SurfOptions{}, "SurfOptions()"),
      "SURF features; Bay, Ess, Tuytelaars, Van Gool, CVIU 2008. Accepts the same images as "
      "saliency_map().");
}

void bind_verification(py::module_& module) {
  py::class_<Verification>(module, "Verification",
                           "The matches and inliers of two images, as structured arrays of query "
                           "and place, int32: the indices of two features.")
      .def_property_readonly(
          "matches", [](const Verification& self) { return take(self.matches); },
          "All one-to-one matches.")
      .def_property_readonly(
          "inliers", [](const Verification& self) { return take(self.inliers); },
          "The matches that fit one epipolar geometry.")
      .def_property_readonly(
          "distinct_inliers", [](const Verification& self) { return self.distinct_inliers; },
          "Number of inliers that count as independent evidence.")
      .def("__repr__", [](const Verification& self) {
        return fmt::format("Verification(matches={}, inliers={}, distinct_inliers={})",
                           self.matches.size(), self.inliers.size(), self.distinct_inliers);
      });
  module.def(
      "match_features",
      [](const Features& query, const Features& place, double max_ratio) {
        std::vector<Match> matches;
        {
          const WithoutGil release;
          matches = match_features(query, place, max_ratio);
        }
        return take(std::move(matches));
      },
      py::arg("query"), py::arg("place"), py::arg("max_ratio"),
      "Mutual best matches that pass the ratio test from both sides, as a structured array of "
      "query and place.");
  module.def(
      "verify",
      [](const Features& query, const Features& place, const VerificationOptions& options) {
        return verify(query, place, options);
      },
      py::arg("query"), py::arg("place"),
      py::arg_v("options", VerificationOptions{}, "VerificationOptions()"),
      py::call_guard<WithoutGil>(),
      "Step 3 for one candidate: matching, then RANSAC with a fixed seed.");
}

}  // namespace

void bind_features(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(Keypoint, x_px, y_px, scale, angle_rad);
  PYBIND11_NUMPY_DTYPE(Match, query, place);
  bind_feature_types(module);
  bind_verification(module);
}

}  // namespace loopbit::python
