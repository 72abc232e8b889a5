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
          "(width, height) of the image that the features were sought in, pixels.")
      .def_property_readonly(
          "num_dark", [](const Features& self) { return self.num_dark; },
          "The first so many are dark blobs, the rest bright ones; each strongest first.")
      .def_property_readonly(
          "keypoints",
          [](const py::object& self) {
            const auto& keypoints = self.cast<const Features&>().keypoints;
            return view_of(keypoints.data(), {static_cast<py::ssize_t>(keypoints.size())}, self);
          },
          "Structured array of x_px, y_px, scale and angle_rad, float32, in pixels of the working "
          "image; read-only, not copied.")
      .def_property_readonly(
          "descriptors",
          [](const py::object& self) -> py::array_t<std::int8_t> {
            const auto& descriptors = self.cast<const Features&>().descriptors;
            const auto* values = descriptors.empty() ? nullptr : descriptors.front().data();
            return view_of(values, {static_cast<py::ssize_t>(descriptors.size()), kDescriptorSize},
                           self);
          },
          "int8, shape (n, 64), each of length 254; read-only, not copied.")
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
      "SURF features; Bay, Ess, Tuytelaars, Van Gool, CVIU 2008. The image as in saliency_map().");
}

void bind_verification(py::module_& module) {
  py::class_<Verification>(module, "Verification",
                           "What the geometry of two images says about them showing one place. "
                           "Matches are structured arrays of query and place, int32: the numbers "
                           "of two features.")
      .def_property_readonly(
          "matches", [](const Verification& self) { return take(self.matches); },
          "All matches, one to one.")
      .def_property_readonly(
          "inliers", [](const Verification& self) { return take(self.inliers); },
          "Those that one epipolar geometry explains.")
      .def_property_readonly(
          "distinct_inliers", [](const Verification& self) { return self.distinct_inliers; },
          "How many inliers are independent evidence.")
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
      "Mutual best matches that pass the ratio test from either side: structured array of query "
      "and place.");
  module.def("verify", &verify, py::arg("query"), py::arg("place"),
             py::arg_v("options", VerificationOptions{}, "VerificationOptions()"),
             py::call_guard<WithoutGil>(),
             "Step 3 for one candidate: matching, then geometry by RANSAC with a fixed seed.");
}

}  // namespace

void bind_features(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(Keypoint, x_px, y_px, scale, angle_rad);
  PYBIND11_NUMPY_DTYPE(Match, query, place);
  bind_feature_types(module);
  bind_verification(module);
}

}  // namespace loopbit::python
