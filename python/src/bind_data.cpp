// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "bind_data.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/error.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/recordings.hpp"
#include "loopbit/truth_file.hpp"

#include "bindings.hpp"
#include "numpy_columns.hpp"
#include "numpy_image.hpp"
#include "numpy_matrix.hpp"
#include "settings.hpp"
#include "text.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Path = std::filesystem::path;
using Free = py::call_guard<WithoutGil>;

std::unique_ptr<SharedSource> open_shared(const Path& input, int every, int limit,
                                          int max_megapixels, const std::string& topic,
                                          const std::string& odometry_topic) {
  const Sampling sampling{every, limit};
  return std::make_unique<SharedSource>(
      subsample(open_input(input.string(), topic, max_megapixels, odometry_topic), sampling),
      input.string(), sampling);
}

Frame next_frame(SharedSource& source) {
  Frame frame;
  {
    const WithoutGil release;
    if (source.next(frame)) return frame;
  }
  throw py::stop_iteration();
}

std::string early_end_of(const SharedSource& source) {
  const WithoutGil release;
  return source.early_end();
}

void bind_frame(py::module_& module) {
  py::class_<Frame>(module, "Frame", "One image of a sequence, or the reason why there is none.")
      .def_property_readonly("name", text_of(&Frame::name),
                             "The name in its folder or list, or its position.")
      .def_readonly("timestamp_s", &Frame::timestamp_s,
                    "Time in seconds, or None if the data set has no times.")
      .def_property_readonly(
          "image", [](const Frame& self) { return to_array(self.image); },
          "uint8 or uint16, (h, w), BGR or BGRA; None if unreadable. Not copied.")
      .def_property_readonly("error", text_of(&Frame::error),
                             "Why the image is unreadable; empty if it is readable.")
      .def_property_readonly(
          "T_odometry_camera",
          [](const Frame& self) {
            return self.T_odometry_camera ? std::optional(square_of(*self.T_odometry_camera))
                                          : std::nullopt;
          },
          "The pose of the camera by the odometry of a recording, metres, shape (4, 4), or None.")
      .def("__repr__", [](const Frame& self) {
        return Text{fmt::format("Frame('{}', {})", self.name,
                                self.image.empty()
                                    ? self.error
                                    : fmt::format("{} x {} px", self.image.cols, self.image.rows))};
      });
}

void bind_topics(py::module_& module) {
  py::class_<Topic>(module, "Topic", "A topic of a recording.")
      .def_property_readonly("name", text_of(&Topic::name), "Such as '/camera/image_raw'.")
      .def_property_readonly("type", text_of(&Topic::type),
                             "Type of its messages, such as 'sensor_msgs/msg/Image'.")
      .def_readonly("messages", &Topic::messages, "How many there are.")
      .def_readonly("has_images", &Topic::has_images, "Whether open_source() reads them.")
      .def("__repr__", [](const Topic& self) {
        return Text{
            fmt::format("Topic('{}', '{}', {} messages)", self.name, self.type, self.messages)};
      });
  module.def(
      "topics",
      [](const Path& recording) { return read_recording_info(recording.string()).topics; },
      py::arg("recording"), Free(),
      "The topics of a ROS bag (.bag, .db3, or the folder of a ROS 2 bag) or MCAP file, by name.");
  module.def(
      "recorded_camera_info",
      [](const Path& recording, const std::string& topic) {
        return Text{recorded_camera_info(recording.string(), topic)};
      },
      py::arg("recording"), py::arg("topic") = "", Free(),
      "The calibration of a recording's images, from camera_info beside their topic, as YAML that "
      "read_cameras() reads from a file. Empty if there is none.");
}

void bind_source(py::module_& module) {
  py::class_<SharedSource>(module, "ImageSource",
                           "A sequence of images, read in order: an iterator of Frame.")
      .def("__iter__", [](SharedSource& self) -> SharedSource& { return self; })
      .def("__next__", &next_frame)
      .def("skip", &SharedSource::skip, Free(),
           "Skips the next frame without decoding it. False at the end.")
      .def("size", &SharedSource::size,
           "The total number of frames, or None if unknown; an estimate for a video.")
      .def(
          "description", [](const SharedSource& self) { return Text{self.description()}; },
          "One line that describes the source.")
      .def(
          "early_end", [](const SharedSource& self) { return Text{early_end_of(self)}; },
          "After the last frame: why the input ended early, such as a video that is cut off. Empty "
          "if it did not.")
      .def_property_readonly(
          "every", [](const SharedSource& self) { return self.sampling().every; },
          "Only every N-th frame is read.")
      .def("__repr__", [](const SharedSource& self) {
        return Text{fmt::format("ImageSource('{}')", self.description())};
      });
  module.def(
      "open_source", &open_shared, py::arg("input"), py::kw_only(), whole("every") = 1,
      whole("limit") = 0, whole("max_megapixels") = kMaxMegapixels, py::arg("topic") = "",
      py::arg("odometry_topic") = "", Free(),
      "Opens a folder of images (natural order), a KITTI odometry, EuRoC or TUM RGB-D "
      "folder, a text file that lists images, an image, a video, a ROS bag or MCAP file, or "
      "'camera:N'. Reads only every N-th frame, and at most limit frames (0 = all). Images above "
      "max_megapixels are unreadable. topic: of a recording; needed if several have images. "
      "odometry_topic: of a recording, with odometry, poses or /tf: gives each frame the pose of "
      "the "
      "camera. /tf_static says where the camera is on the robot.");
  bind_topics(module);
}

std::vector<PlaceRun> to_runs(const ArrayLike& argument, const char* name) {
  const FrameTable table = to_frame_table(argument, name);
  std::vector<PlaceRun> runs;
  if (table.size() == 0) return runs;
  if (table.ndim() != 2 || (table.shape(1) != 2 && table.shape(1) != 3)) {
    throw py::value_error(
        fmt::format("{} has shape {}, but must be (n, 2): query, match; or (n, 3): query, first, "
                    "last.",
                    name, literal(table.attr("shape"))));
  }
  runs.reserve(static_cast<std::size_t>(table.shape(0)));
  for (py::ssize_t row = 0; row < table.shape(0); ++row) {
    const PlaceRun run{table.at(row, 0), table.at(row, 1), table.at(row, table.shape(1) - 1)};
    if (run.first > run.last || run.last >= run.query) {
      throw py::value_error(fmt::format("{}, row {}: ({}, {}, {}) is not first <= last < query.",
                                        name, row, run.query, run.first, run.last));
    }
    runs.push_back(run);
  }
  return runs;
}

GroundTruth to_truth(const ArrayLike& same_place, const ArrayLike& near_place,
                     const ArrayLike& ignored, const ArrayLike& unknown, int every, int frames) {
  check_every(every);
  GroundTruth truth;
  truth.same_place = to_runs(same_place, "same_place");
  truth.near_place = to_runs(near_place, "near_place");
  truth.ignored = to_frames(ignored, "ignored");
  truth.unknown = to_frames(unknown, "unknown");
  truth.every = every;
  truth.frames = frames;
  return truth;
}

void bind_truth(py::module_& module) {
  py::class_<GroundTruth>(module, "GroundTruth",
                          "The ground truth of a sequence, counted in all its frames. Structured "
                          "arrays of query, first and last, int32: the frames first to last show "
                          "the place of frame query.")
      .def(py::init(&to_truth), py::arg("same_place"), py::arg("near_place") = py::tuple(),
           py::arg("ignored") = py::tuple(), py::arg("unknown") = py::tuple(), whole("every") = 1,
           whole("frames") = 0,
           "From integers of shape (n, 2), query and match, or (n, 3), query, first and last. "
           "Places are earlier than their query.")
      .def_property_readonly(
          "same_place", [](const GroundTruth& self) { return take(self.same_place); },
          "True earlier places.")
      .def_property_readonly(
          "near_place", [](const GroundTruth& self) { return take(self.near_place); },
          "Matches that are not wrong; they are right only if same_place has them, too.")
      .def_property_readonly(
          "ignored", [](const GroundTruth& self) -> py::array_t<int> { return take(self.ignored); },
          "Queries that are not scored.")
      .def_property_readonly(
          "unknown", [](const GroundTruth& self) -> py::array_t<int> { return take(self.unknown); },
          "Frames of unknown places: not scored as queries, and never wrong as matches.")
      .def_readonly("every", &GroundTruth::every,
                    "Only every N-th frame of the sequence was read. Frame k of the run is frame k "
                    "* every here.")
      .def_readonly("frames", &GroundTruth::frames,
                    "Number of frames that the truth covers; 0 = unknown.")
      .def("__repr__", [](const GroundTruth& self) {
        return fmt::format(
            "GroundTruth(same_place={} rows, near_place={} rows, ignored={}, unknown={}, every={}, "
            "frames={})",
            self.same_place.size(), self.near_place.size(), self.ignored.size(),
            self.unknown.size(), self.every, self.frames);
      });
  py::enum_<TruthKind>(module, "TruthKind", "The kind of a file of ground truth.")
      .value("runs", TruthKind::runs, "rows of query,first,last or query,match")
      .value("matrix", TruthKind::matrix, "one cell per pair of frames")
      .value("poses", TruthKind::poses, "camera poses");
}

void bind_poses(py::module_& module) {
  bind_settings<PoseTruthOptions>(module, "PoseTruthOptions", "truth",
                                  "When two frames with known poses show the same place.");
  module.def(
      "read_positions",
      [](const Path& path, FrameTimes times_s, int every) {
        const auto read = [&] {
          const WithoutGil release;
          return read_positions(path.string(), {.every = every, .times_s = std::move(times_s)});
        };
        return to_array(read());
      },
      py::arg("path"), py::arg("times_s"), whole("every") = 1,
      "Camera centres from KITTI poses, a TUM trajectory or EuRoC states: shape (n, 3), one row "
      "per entry of times_s, nan if unknown. times_s has the times of the frames read, or None for "
      "a frame without a time. every means that only every N-th frame of the sequence was read.");
}

}  // namespace

void bind_data(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PlaceRun, query, first, last);
  bind_frame(module);
  bind_source(module);
  bind_truth(module);
  bind_poses(module);
  module.def(
      "truth_kind", [](const Path& path) { return truth_kind(path.string()); }, py::arg("path"),
      Free(), "The kind of a file of ground truth.");
  module.def("every_nth", &every_nth, py::arg("truth"), whole("every"), Free(),
             "The ground truth of every N-th frame, numbered by the frames that were read.");
}

}  // namespace loopbit::python
