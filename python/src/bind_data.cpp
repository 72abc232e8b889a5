// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "bind_data.hpp"

#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/error.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/truth_file.hpp"

#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Path = std::filesystem::path;
using Table = py::array_t<int, py::array::c_style | py::array::forcecast>;
using Times = std::vector<std::optional<double>>;

std::unique_ptr<SharedSource> open_shared(const Path& input, int every, int limit) {
  if (every < 1 || limit < 0) {
    throw Error(ErrorKind::option,
                fmt::format("every is {} and limit is {}, but every must be at least 1, and limit "
                            "0 (no limit) or more.",
                            every, limit));
  }
  auto source = subsample(open_source(input.string()), static_cast<std::size_t>(every),
                          static_cast<std::size_t>(limit));
  return std::make_unique<SharedSource>(std::move(source), input.string(), every, limit);
}

Frame next_frame(SharedSource& source) {
  Frame frame;
  {
    const py::gil_scoped_release release;
    if (source.next(frame)) return frame;
  }
  throw py::stop_iteration();
}

void bind_source(py::module_& module) {
  py::class_<Frame>(module, "Frame", "One image of a sequence, or the reason why there is none.")
      .def_readonly("name", &Frame::name, "Its name in its folder or list, or its position.")
      .def_readonly("timestamp_s", &Frame::timestamp_s, "Seconds, where the data set has times.")
      .def_property_readonly(
          "image", [](const Frame& self) { return to_array(self.image); },
          "uint8 or uint16, (h, w), or BGR or BGRA; None if it is unreadable. Not copied.")
      .def_readonly("error", &Frame::error, "Empty, or why the image is unreadable.")
      .def("__repr__", [](const Frame& self) {
        return fmt::format("Frame('{}', {})", self.name,
                           self.image.empty()
                               ? self.error
                               : fmt::format("{} x {} px", self.image.cols, self.image.rows));
      });
  py::class_<SharedSource>(module, "ImageSource",
                           "A sequence of images, read in order: an iterator of Frame.")
      .def("__iter__", [](SharedSource& self) -> SharedSource& { return self; })
      .def("__next__", &next_frame)
      .def("skip", &SharedSource::skip, py::call_guard<py::gil_scoped_release>(),
           "Passes over the next frame without decoding it. False at the end.")
      .def("size", &SharedSource::size,
           "How many frames there are in all, where that is known; for a video an estimate.")
      .def("description", &SharedSource::description, "One line that says what it is.")
      .def_property_readonly("every", &SharedSource::every, "Every so many-th frame is read.")
      .def("__repr__", [](const SharedSource& self) {
        return fmt::format("ImageSource('{}')", self.description());
      });
  module.def("open_source", &open_shared, py::arg("input"), py::kw_only(), py::arg("every") = 1,
             py::arg("limit") = 0, py::call_guard<py::gil_scoped_release>(),
             "Opens a folder of images (natural order), a KITTI odometry, EuRoC or TUM RGB-D "
             "folder, a text file that lists images, an image, a video, or 'camera:N'. Every so "
             "many-th frame is read, at most so many (0: all).");
}

std::vector<PlaceRun> to_runs(const Table& table, const char* name) {
  const bool is_empty = table.size() == 0;
  if (!is_empty && (table.ndim() != 2 || (table.shape(1) != 2 && table.shape(1) != 3))) {
    throw py::value_error(
        fmt::format("{} has shape {}, but must be (n, 2): query, match; or (n, 3): query, first, "
                    "last.",
                    name, literal(table.attr("shape"))));
  }
  std::vector<PlaceRun> runs;
  if (is_empty) return runs;
  runs.reserve(static_cast<std::size_t>(table.shape(0)));
  for (py::ssize_t row = 0; row < table.shape(0); ++row) {
    runs.push_back({table.at(row, 0), table.at(row, 1), table.at(row, table.shape(1) - 1)});
  }
  return runs;
}

void bind_truth(py::module_& module) {
  py::class_<GroundTruth>(module, "GroundTruth",
                          "What is true about a sequence: structured arrays of query, first and "
                          "last, int32; the frames first to last show what frame query shows.")
      .def(py::init([](const Table& same_place, const Table& near_place,
                       const std::vector<int>& ignored) {
             return GroundTruth{to_runs(same_place, "same_place"),
                                to_runs(near_place, "near_place"), ignored};
           }),
           py::arg("same_place"), py::arg_v("near_place", Table(0), "()"),
           py::arg_v("ignored", std::vector<int>{}, "()"),
           "From integers of shape (n, 2): query, match; or (n, 3): query, first, last.")
      .def_property_readonly(
          "same_place", [](const GroundTruth& self) { return take(self.same_place); },
          "True earlier places.")
      .def_property_readonly(
          "near_place", [](const GroundTruth& self) { return take(self.near_place); },
          "A match here is not false, nor right by this alone.")
      .def_property_readonly(
          "ignored", [](const GroundTruth& self) -> py::array_t<int> { return take(self.ignored); },
          "Queries that are not scored.")
      .def("__repr__", [](const GroundTruth& self) {
        return fmt::format("GroundTruth(same_place={} rows, near_place={} rows, ignored={})",
                           self.same_place.size(), self.near_place.size(), self.ignored.size());
      });
  py::enum_<TruthKind>(module, "TruthKind", "What a file says places are the same by.")
      .value("runs", TruthKind::runs, "rows of query,first,last or query,match")
      .value("matrix", TruthKind::matrix, "a cell for every two frames")
      .value("poses", TruthKind::poses, "where the camera stood");
}

void bind_poses(py::module_& module) {
  bind_settings<PoseTruthOptions>(module, "PoseTruthOptions", "truth",
                                  "When two frames with known poses show the same place.");
  module.def(
      "read_positions",
      [](const Path& path, const Times& times_s) {
        const auto poses = poses_of_frames(read_poses(path.string()), times_s);
        std::vector<std::optional<cv::Vec3d>> positions_m;
        positions_m.reserve(poses.size());
        for (const auto& pose : poses) {
          positions_m.push_back(pose ? std::optional(pose->position_m) : std::nullopt);
        }
        return to_array(positions_m);
      },
      py::arg("path"), py::arg("times_s"),
      "Camera centres by KITTI poses or a TUM trajectory, shape (n, 3), nan where not known; one a "
      "time, None where a frame has none.");
}

}  // namespace

void bind_data(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PlaceRun, query, first, last);
  bind_source(module);
  bind_truth(module);
  bind_poses(module);
  module.def(
      "truth_kind", [](const Path& path) { return truth_kind(path.string()); }, py::arg("path"),
      "The kind of a file of ground truth.");
  module.def(
      "_read_truth",
      [](const Path& path, const PoseTruthOptions& poses, const std::string& variable, int views,
         const Times& times_s) {
        return read_truth(path.string(), {poses, variable, views}, times_s);
      },
      py::arg("path"), py::arg("poses"), py::arg("variable"), py::arg("views"), py::arg("times_s"),
      py::call_guard<py::gil_scoped_release>());
  module.def(
      "_read_place_runs", [](const Path& path) { return take(read_place_runs(path.string())); },
      py::arg("path"));
  module.def(
      "_read_frame_list", [](const Path& path) { return read_frame_list(path.string()); },
      py::arg("path"));
  module.def("every_nth", &every_nth, py::arg("truth"), py::arg("every"),
             "What the truth says where only every so many-th frame was read.");
}

}  // namespace loopbit::python
