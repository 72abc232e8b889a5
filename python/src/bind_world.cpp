// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <memory>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/error.hpp"
#include "loopbit/world.hpp"
#include "loopbit/world_dataset.hpp"

#include "bind_data.hpp"
#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Free = py::call_guard<WithoutGil>;

/// Throws Error if `world` does not have the frame.
void check_frame(const World& world, int frame) {
  if (frame >= 0 && frame < world.options().frames) return;
  throw Error(ErrorKind::option, fmt::format("frame is {}, but must be between 0 and {}.", frame,
                                             world.options().frames - 1));
}

}  // namespace

void bind_world(py::module_& module) {
  bind_settings<WorldOptions>(module, "WorldOptions", "world", "Settings of the built-in world.");
  py::class_<World, std::shared_ptr<World>>(module, "World",
                                            "A town, a drive through it, and its exact ground "
                                            "truth. The same options give the same images on every "
                                            "machine.")
      .def(py::init([](const WorldOptions& options) {
             const WorldOptions own = options;  // others may change it while the GIL is free
             const WithoutGil release;
             return std::make_shared<World>(own);
           }),
           py::arg_v("options", WorldOptions{}, "WorldOptions()"))
      .def_property_readonly("options", [](const World& self) { return self.options(); })
      .def("__len__", [](const World& self) { return self.options().frames; })
      .def(
          "render",
          [](const World& self, int frame) -> py::array_t<std::uint8_t> {
            check_frame(self, frame);
            cv::Mat image;
            {
              const WithoutGil release;
              image = self.render(frame);
            }
            return to_array(image);
          },
          whole("frame"), "The camera image, BGR, uint8. About 25 ms for 640 x 480.")
      .def(
          "pose",
          [](const World& self, int frame) {
            check_frame(self, frame);
            const Pose pose = self.pose(frame);
            return std::tuple(pose.x_m, pose.y_m, pose.heading_rad);
          },
          whole("frame"), "(x_m, y_m, heading_rad): x east, y north, heading from east to north.")
      .def(
          "truth",
          [](const World& self) {
            GroundTruth truth;
            truth.same_place = self.same_place();
            truth.near_place = self.near_place();
            return truth;
          },
          Free(), "The ground truth of the drive.")
      .def(
          "source",
          [](const std::shared_ptr<World>& self) {
            return std::make_unique<SharedSource>(make_world_source(self), "built-in world");
          },
          "The drive as a sequence of images, 10 frames per second.")
      .def(
          "write_dataset",
          [](const World& self, const std::filesystem::path& folder) {
            write_dataset(self, folder.string(), [](int /*frame*/) { check_signals(); });
          },
          py::arg("folder"), Free(),
          "Writes the drive as a data set: images, times, poses and truth.")
      .def("__repr__", [](const World& self) {
        return fmt::format("World({} frames on a circuit of {:.0f} m)", self.options().frames,
                           self.circuit_m());
      });
}

}  // namespace loopbit::python
