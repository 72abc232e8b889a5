// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"
#include "shared_map.hpp"
#include "text.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Free = py::call_guard<WithoutGil>;

/// A row of places().
struct PlaceRow {
  std::int64_t id;
  int session;
  int frame;
  double timestamp_s;
  std::array<std::uint64_t, kContentSide> content;
};

/// A row of loops().
struct LoopRow {
  int query_session;
  int query_frame;
  int match_session;
  int match_frame;
  double score;
  double similarity;
  int matches;
  int inliers;
};

/// A row of odometry().
struct OdometryRow {
  int session;
  int frame;
  double timestamp_s;
  std::array<std::array<double, 4>, 4> pose;
  std::array<std::array<double, 6>, 6> covariance;
};

std::vector<OdometryRow> odometry_of(MapReader& map) {
  std::vector<OdometryRow> rows;
  for (const MapOdometry& odometry : map.odometry()) {
    OdometryRow& row = rows.emplace_back(OdometryRow{odometry.at.session,
                                                     odometry.at.frame,
                                                     odometry.timestamp_s.value_or(std::nan("")),
                                                     {},
                                                     {}});
    const cv::Matx66d covariance = odometry.pose.covariance.value_or(cv::Matx66d::zeros());
    std::copy_n(odometry.pose.T_odometry_camera.val, 16, row.pose.front().data());
    std::copy_n(covariance.val, 36, row.covariance.front().data());
  }
  return rows;
}

std::vector<PlaceRow> places_of(MapReader& map) {
  std::vector<PlaceRow> rows;
  map.for_each_place([&](const MapPlace& place) {
    rows.push_back({place.id, place.at.session, place.at.frame,
                    place.timestamp_s.value_or(std::nan("")), place.content.rows});
  });
  return rows;
}

std::vector<LoopRow> rows_of(const std::vector<MapLoop>& loops) {
  std::vector<LoopRow> rows;
  rows.reserve(loops.size());
  for (const MapLoop& loop : loops) {
    rows.push_back({loop.query.session, loop.query.frame, loop.match.session, loop.match.frame,
                    loop.score, loop.similarity, loop.matches, loop.inliers});
  }
  return rows;
}

std::vector<LoopRow> loops_of(MapReader& map) { return rows_of(map.loops()); }
std::vector<LoopRow> rejected_loops_of(MapReader& map) { return rows_of(map.rejected_loops()); }

/// Calls a method of a map that has no parameters.
template <auto method, typename Map>
auto call(Map& map) {
  return map.exclusively([](auto& free) { return (free.*method)(); });
}

/// The rows of `rows_of` as an array. Releases the GIL while collecting them.
template <typename Row>
py::array array_of(SharedReader& map, std::vector<Row> (*rows_of)(MapReader&)) {
  std::vector<Row> rows;
  {
    const WithoutGil release;
    rows = map.exclusively(rows_of);
  }
  return take(std::move(rows));
}

/// Throws TypeError unless `row` is a row of places().
MapPlace place_of(const py::object& row) {
  try {
    const auto number = [&](const char* name) { return row[name].cast<std::int64_t>(); };
    return {.id = number("id"),
            .at = {static_cast<int>(number("session")), static_cast<int>(number("frame"))}};
  } catch (const std::exception&) {  // it cannot be asked, has no such field, or no number there
    throw py::type_error(fmt::format("place is {}, but must be a row of places().", literal(row)));
  }
}

std::optional<Features> features_of(SharedReader& map, const py::object& row) {
  const MapPlace place = place_of(row);
  const WithoutGil release;
  return map.exclusively([&](MapReader& reader) { return reader.features_of(place); });
}

std::optional<py::bytes> image_of(SharedReader& map, const py::object& row) {
  const MapPlace place = place_of(row);
  std::optional<std::vector<unsigned char>> jpeg;
  {
    const WithoutGil release;
    jpeg = map.exclusively([&](MapReader& reader) { return reader.image_of(place); });
  }
  if (!jpeg) return std::nullopt;
  return py::bytes(reinterpret_cast<const char*>(jpeg->data()), jpeg->size());
}

std::string queue_of(SharedWriter& map) {
  return map.exclusively([](MapWriter& writer) { return writer.queue(); });
}

void set_epoch(SharedReader& map, std::int64_t epoch) {
  map.exclusively([&](MapReader& reader) { reader.set_epoch(epoch); });
}

void bind_session_frame(py::module_& module) {
  py::class_<SessionFrame>(module, "SessionFrame", "A frame of a session of a map.")
      .def(py::init([](int session, int frame) {
             return SessionFrame{session, frame};
           }),
           whole("session"), whole("frame"))
      .def_readonly("session", &SessionFrame::session,
                    "Number of the session, from 1, in the order in which they were added.")
      .def_readonly("frame", &SessionFrame::frame, "Number of the frame in its session, from 0.")
      .def(
          "__eq__", [](const SessionFrame& a, const SessionFrame& b) { return a == b; },
          py::is_operator())
      .def("__hash__",
           [](const SessionFrame& self) {
             return py::hash(py::make_tuple(self.session, self.frame));
           })
      .def("__repr__", [](const SessionFrame& self) {
        return fmt::format("SessionFrame(session={}, frame={})", self.session, self.frame);
      });
}

void bind_session(py::module_& module) {
  py::class_<MapSession>(module, "MapSession", "A session of a map: one continuous recording.")
      .def_readonly("session", &MapSession::session,
                    "Number of the session, from 1; never reused in a map.")
      .def_readonly("uid", &MapSession::uid,
                    "32 hexadecimal digits, the same in every copy of the session.")
      .def_property_readonly("name", text_of(&MapSession::name), "The input, as the user named it.")
      .def_readonly("started", &MapSession::started, "UTC, such as '2026-11-21T15:04:05Z'.")
      .def_readonly("loopbit", &MapSession::loopbit, "The version of loopbit that wrote it.")
      .def_readonly("options", &MapSession::options,
                    "The settings of its detector, as in to_json().")
      .def_readonly("frames", &MapSession::frames,
                    "Number of frames, including unreadable ones, which have no place.")
      .def_readonly("linked", &MapSession::linked,
                    "Whether it was compared with all earlier sessions, when it was recorded or by "
                    "link_map().")
      .def("__repr__", [](const MapSession& self) {
        return fmt::format("MapSession({}, {}, started {}, {} frames)", self.session,
                           literal(py::cast(Text{self.name})), self.started, self.frames);
      });
}

void bind_reader(py::module_& module) {
  py::class_<SharedReader, SharedMap, std::shared_ptr<SharedReader>>(
      module, "MapReader",
      "Reads a map, also while it is being written. Each read sees what is committed at that time. "
      "Damaged rows are left out.")
      .def(
          py::init<const std::filesystem::path&, std::size_t>(), py::arg("path"),
          py::arg("cache_mb") = kMapCache_mb, Free(),
          "Raises InputError if the map is missing or cannot be read. cache_mb limits the features "
          "kept in memory, in MiB. path may be the address of a map on a server, "
          "'postgresql://...'.")
      .def_property_readonly("sessions",
                             py::cpp_function(&call<&MapReader::sessions, SharedReader>, Free()),
                             "The sessions that existed when the map was opened, in order.")
      .def_property_readonly(
          "options", py::cpp_function(&call<&MapReader::options, SharedReader>, Free()),
          "The defaults with the settings of the map's places. Raises InputError if no session has "
          "them.")
      .def(
          "places", [](SharedReader& self) { return array_of(self, places_of); },
          "All undamaged places in order of id: structured array of id, session, frame, "
          "timestamp_s (nan if there is none) and content (64 words, for BinaryContent()). Half a "
          "kilobyte per place; features are not read.")
      .def(
          "loops", [](SharedReader& self) { return array_of(self, loops_of); },
          "All undamaged loops in the order in which they were found: structured array of "
          "query_session, query_frame, match_session, match_frame, score, similarity, matches and "
          "inliers.")
      .def(
          "rejected_loops", [](SharedReader& self) { return array_of(self, rejected_loops_of); },
          "All undamaged loops that LoopDetector.reject() or a pose graph withdrew, in the form of "
          "loops().")
      .def(
          "odometry", [](SharedReader& self) { return array_of(self, odometry_of); },
          "The undamaged odometry of all frames that have some, by session and frame: structured "
          "array of session, frame, timestamp_s (nan if there is none), pose (4 x 4: x_odometry = "
          "pose x_camera, in metres) and covariance (6 x 6: of the motion since the frame with "
          "odometry before, with the conventions of RelativePose).")
      .def("features_of", &features_of, py::arg("place"),
           "The features of a place, which is a row of places(); None if they are damaged.")
      .def("image_of", &image_of, py::arg("place"),
           "The small JPEG of a place, which is a row of places(), as bytes; None if it was not "
           "kept or is damaged.")
      .def_property_readonly("damage",
                             py::cpp_function(&call<&MapReader::damage, SharedReader>, Free()),
                             "The damage found so far, one clause each.")
      .def("set_epoch", &set_epoch, py::arg("epoch"), Free(),
           "From now on, a LoopDetector of this map sees what was committed up to this epoch, "
           "without what was removed or rejected since then. Raises OptionError if the map is not "
           "on a server or has not come so far.")
      .def("check_structure", &call<&MapReader::check_structure, SharedReader>, Free(),
           "The errors that SQLite's integrity_check reports; empty if there are none.")
      .def("__repr__", [](const SharedReader& self) {
        return fmt::format("MapReader({})", literal(py::cast(Text{self.path()})));
      });
}

void bind_shards(py::module_& module) {
  py::class_<SharedShards, SharedMap, std::shared_ptr<SharedShards>>(
      module, "ShardedMap",
      "Reads a map whose sessions are distributed over several servers. A detector of it gives the "
      "answers of one map with all sessions; it only queries. A server that does not answer is "
      "left out from then on.")
      .def(py::init<const std::vector<std::string>&, std::size_t>(), py::arg("addresses"),
           py::arg("cache_mb") = kMapCache_mb, Free(),
           "Raises the error of the first server if none can be asked, and OptionError if two have "
           "different sessions of the same number. cache_mb limits the features kept in memory, in "
           "MiB.")
      .def_property_readonly(
          "options", py::cpp_function(&call<&ShardedMap::options, SharedShards>, Free()),
          "The defaults with the settings of the map's places. Raises InputError if no session has "
          "them.")
      .def_property_readonly("damage",
                             py::cpp_function(&call<&ShardedMap::damage, SharedShards>, Free()),
                             "The damage found so far, one clause each.")
      .def_property_readonly("not_asked",
                             py::cpp_function(&call<&ShardedMap::not_asked, SharedShards>, Free()),
                             "The addresses of the servers that are left out, without passwords.")
      .def("take_notices", &call<&ShardedMap::take_notices, SharedShards>, Free(),
           "Why they are, one sentence each, since the last call.")
      .def("__repr__", [](const SharedShards& self) {
        return fmt::format("ShardedMap({})", literal(py::cast(Text{self.path()})));
      });
}

void bind_writer(py::module_& module) {
  py::class_<SharedWriter, SharedMap, std::shared_ptr<SharedWriter>>(
      module, "MapWriter",
      "Writes a new session of a LoopDetector to a map. A map has one writer. Frames are committed "
      "in batches of 32, or after one second. The with statement calls finish() at its end. In a "
      "forked child, every use raises OptionError.")
      .def(
          py::init([](const std::filesystem::path& path, const LoopDetectorOptions& options,
                      const std::filesystem::path& name, bool keep_images, std::size_t cache_mb,
                      const std::optional<std::filesystem::path>& queue) {
            return std::make_shared<SharedWriter>(path, options, name.string(), keep_images,
                                                  cache_mb, queue);
          }),
          py::arg("path"), py::arg("options"), py::arg("name"), py::arg("keep_images") = false,
          py::arg("cache_mb") = kMapCache_mb, py::arg("queue") = py::none(), Free(),
          "Creates or continues a map. name describes the input of the session. keep_images also "
          "stores a small JPEG of each place. cache_mb limits the features kept in memory, in MiB. "
          "A session without frames is not stored. Raises OutputError if the map has a writer or "
          "cannot be written, and OptionError if it was made with other settings of "
          "binary_content or surf. path may be the address of a map on a server, "
          "'postgresql://...', whose frames are queued in the map file queue first, by default "
          "'town_session_2_queue.db' in the working folder. Of several addresses, separated by "
          "spaces, the first one gets the session.")
      .def_property_readonly("session",
                             py::cpp_function(&call<&MapWriter::session, SharedWriter>, Free()),
                             "Number of the session that is being written.")
      .def_property_readonly(
          "saved_frames", py::cpp_function(&call<&MapWriter::saved_frames, SharedWriter>, Free()),
          "Number of committed frames of this session. They survive crashes.")
      .def_property_readonly("damage",
                             py::cpp_function(&call<&MapWriter::damage, SharedWriter>, Free()),
                             "The damage found in candidates so far, one clause each.")
      .def_property_readonly(
          "queue",
          [](SharedWriter& self) {
            const std::string queue = [&] {
              const WithoutGil release;
              return queue_of(self);
            }();
            return Text{queue};
          },
          "The file of the queue, for merge_map(); empty if the map is a file, or the server has "
          "everything after finish().")
      .def_property_readonly(
          "reconnections", py::cpp_function(&call<&MapWriter::reconnections, SharedWriter>, Free()),
          "How often the server did not take frames for a while, and did so later.")
      .def_property_readonly(
          "unverified", py::cpp_function(&call<&MapWriter::unverified, SharedWriter>, Free()),
          "How often a place was no match because the server did not send its features in time.")
      .def_property_readonly(
          "not_asked", py::cpp_function(&call<&MapWriter::not_asked, SharedWriter>, Free()),
          "Of several servers, those that did not answer, at the start or for a while.")
      .def("take_notices", &call<&MapWriter::take_notices, SharedWriter>, Free(),
           "Sentences on the server, for the user, since the last call.")
      .def("flush", &call<&MapWriter::flush, SharedWriter>, Free(),
           "Commits what was added so far.")
      .def(
          "finish", &call<&MapWriter::finish, SharedWriter>, Free(),
          "Commits the rest and closes the file. A detector of this map cannot be used afterwards. "
          "An unused writer does the same when it is collected, but ignores errors. What a server "
          "does not take stays in queue.")
      .def("__enter__", [](const std::shared_ptr<SharedWriter>& self) { return self; })
      .def(
          "__exit__",
          [](SharedWriter& self, const py::object& /*type*/, const py::object& /*error*/,
             const py::object& /*traceback*/) { call<&MapWriter::finish>(self); },
          py::arg("type"), py::arg("error"), py::arg("traceback"), Free())
      .def("__repr__", [](const SharedWriter& self) {
        return fmt::format("MapWriter({})", literal(py::cast(Text{self.path()})));
      });
}

}  // namespace

void bind_map(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PlaceRow, id, session, frame, timestamp_s, content);
  PYBIND11_NUMPY_DTYPE(LoopRow, query_session, query_frame, match_session, match_frame, score,
                       similarity, matches, inliers);
  PYBIND11_NUMPY_DTYPE(OdometryRow, session, frame, timestamp_s, pose, covariance);
  bind_session_frame(module);
  bind_session(module);
  py::class_<SharedMap, std::shared_ptr<SharedMap>>(
      module, "MapStorage", "Base of MapReader, MapWriter and ShardedMap, for LoopDetector.")
      .def_property_readonly("path", [](const SharedMap& self) { return Text{self.path()}; });
  bind_reader(module);
  bind_shards(module);
  bind_writer(module);
}

}  // namespace loopbit::python
