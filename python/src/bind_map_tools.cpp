// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/error.hpp"
#include "loopbit/map_graph.hpp"
#include "loopbit/map_tools.hpp"

#include "bindings.hpp"
#include "shared_map.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Path = std::filesystem::path;
using Free = py::call_guard<WithoutGil>;

void bind_results(py::module_& module) {
  py::class_<MapCheck>(module, "MapCheck", "The content of a map and its damage.")
      .def_readonly("sessions", &MapCheck::sessions)
      .def_readonly("places", &MapCheck::places, "Number of undamaged places with their features.")
      .def_readonly("loops", &MapCheck::loops)
      .def_readonly("images", &MapCheck::images, "Number of undamaged images.")
      .def_readonly("damage", &MapCheck::damage,
                    "The damage, one clause each; empty if there is none.")
      .def("__repr__", [](const MapCheck& self) {
        return fmt::format("MapCheck(sessions={}, places={}, loops={}, images={}, damage={})",
                           self.sessions, self.places, self.loops, self.images, self.damage.size());
      });
  py::class_<MergeCounts>(module, "MergeCounts", "The result of merge_map().")
      .def_readonly("sessions", &MergeCounts::sessions)
      .def_readonly("places", &MergeCounts::places)
      .def_readonly("loops", &MergeCounts::loops)
      .def_readonly("known", &MergeCounts::known,
                    "Sessions that the map already had, compared by uid.")
      .def("__repr__", [](const MergeCounts& self) {
        return fmt::format("MergeCounts(sessions={}, places={}, loops={}, known={})", self.sessions,
                           self.places, self.loops, self.known);
      });
  py::class_<MoveCounts>(module, "MoveCounts", "The result of move_sessions().")
      .def_readonly("sessions", &MoveCounts::sessions)
      .def_readonly("places", &MoveCounts::places)
      .def_readonly("known", &MoveCounts::known,
                    "Sessions that had been moved before: only the second map has them.")
      .def("__repr__", [](const MoveCounts& self) {
        return fmt::format("MoveCounts(sessions={}, places={}, known={})", self.sessions,
                           self.places, self.known);
      });
  py::class_<LinkCounts>(module, "LinkCounts", "The result of link_map().")
      .def_readonly("sessions", &LinkCounts::sessions, "Sessions compared with all earlier ones.")
      .def_readonly("places", &LinkCounts::places,
                    "Places of these sessions, which were processed.")
      .def_readonly("loops", &LinkCounts::loops, "Loops found and stored.")
      .def("__repr__", [](const LinkCounts& self) {
        return fmt::format("LinkCounts(sessions={}, places={}, loops={})", self.sessions,
                           self.places, self.loops);
      });
  py::class_<CompactCounts>(module, "CompactCounts", "The result of compact_map().")
      .def_readonly("places_before", &CompactCounts::places_before)
      .def_readonly("places_after", &CompactCounts::places_after)
      .def_readonly("bytes_before", &CompactCounts::bytes_before)
      .def_readonly("bytes_after", &CompactCounts::bytes_after)
      .def("__repr__", [](const CompactCounts& self) {
        return fmt::format(
            "CompactCounts(places_before={}, places_after={}, bytes_before={}, bytes_after={})",
            self.places_before, self.places_after, self.bytes_before, self.bytes_after);
      });
}

/// The query and match of a loop.
using LoopPair = std::pair<SessionFrame, SessionFrame>;

void bind_correction(py::module_& module) {
  py::class_<MapCorrection>(module, "MapCorrection", "The result of correct_map().")
      .def_property_readonly(
          "keyframes", [](const MapCorrection& self) { return self.correction.keyframes; },
          "Number of frames with odometry.")
      .def_property_readonly(
          "kept", [](const MapCorrection& self) { return self.correction.kept(); },
          "Number of loops that are kept.")
      .def_property_readonly(
          "unjudged", [](const MapCorrection& self) { return self.correction.unjudged; },
          "Number of loops of frames without odometry.")
      .def_property_readonly(
          "rejected",
          [](const MapCorrection& self) {
            std::vector<LoopPair> loops;
            for (const MapLoop& loop : self.rejected) loops.emplace_back(loop.query, loop.match);
            return loops;
          },
          "Query and match of each loop that is rejected, for reject_loops().")
      .def_property_readonly(
          "frame_of",
          [](const MapCorrection& self) {
            std::map<int, int> frame_of;
            for (const MapCorrection::Session& session : self.sessions) {
              if (session.keyframes > 0) frame_of[session.session] = session.frame_of;
            }
            return frame_of;
          },
          "For each session with odometry, the first session that kept loops join it to, in whose "
          "frame its corrected poses are; itself if there is none before.")
      .def("__repr__", [](const MapCorrection& self) {
        return fmt::format("MapCorrection(keyframes={}, kept={}, rejected={}, unjudged={})",
                           self.correction.keyframes, self.correction.kept(), self.rejected.size(),
                           self.correction.unjudged);
      });
  module.def(
      "correct_map",
      [](SharedReader& map, const std::optional<Path>& folder) {
        return map.exclusively([&](MapReader& reader) {
          return correct_map(reader, folder.value_or(Path()).string());
        });
      },
      py::arg("map"), py::arg("folder") = py::none(), Free(),
      "Solves the pose graph of all sessions of a map that have odometry. Writes the corrected "
      "trajectories, the graph and the evidence for each loop to a new folder, if one is given, as "
      "loopbit graph does. The map is only read. Raises InputError if no frame has odometry, and "
      "OutputError if the folder has files.");
  module.def(
      "reject_loops",
      [](const Path& path, const std::vector<LoopPair>& pairs) {
        std::vector<MapLoop> loops;
        for (const auto& [query, match] : pairs) loops.push_back({.query = query, .match = match});
        reject_loops(path.string(), loops);
      },
      py::arg("path"), py::arg("loops"), Free(),
      "Withdraws loops in a map, given as pairs of query and match: they are not exported, and "
      "later sessions do not use them.");
}

/// What brings the sessions of maps together.
void bind_sessions(py::module_& module) {
  module.def(
      "merge_map",
      [](const Path& into, const Path& other) { return merge_map(into.string(), other.string()); },
      py::arg("into"), py::arg("other"), Free(),
      "Copies the sessions of another map that this one lacks, with their places and loops. Copies "
      "everything or nothing. Creates the map if there is none.");
  module.def(
      "move_sessions",
      [](const Path& source, const Path& to, const std::vector<int>& sessions) {
        return move_sessions(source.string(), to.string(), sessions);
      },
      py::arg("source"), py::arg("to"), py::arg("sessions"), Free(),
      "Moves sessions from one server to another, under their numbers. Each is copied, read again "
      "and compared before it is removed, so that a second call continues after a crash. Needs the "
      "owners of both maps.");
  module.def(
      "link_map",
      [](const Path& path, const std::optional<LoopDetectorOptions>& options) {
        return link_map(path.string(), options, [](const LinkCounts& /*counts*/) {
          check_signals();
          return true;
        });
      },
      py::arg("path"), py::arg("options") = py::none(), Free(),
      "Finds the loops between sessions that never met, such as those of merged maps, and adds "
      "them to the map. Each such session is processed again from its stored contents and "
      "features, with all earlier sessions as candidates. Without options, uses the settings that "
      "each session was recorded with. A session is added completely or not at all.");
}

}  // namespace

void bind_map_tools(py::module_& module) {
  bind_results(module);
  bind_correction(module);
  bind_sessions(module);
  module.def(
      "check_map", [](const Path& path) { return check_map(path.string()); }, py::arg("path"),
      Free(), "Checks a map by reading every byte. Raises InputError like MapReader.");
  module.def(
      "recover_map",
      [](const Path& path, const Path& to) { return recover_map(path.string(), to.string()); },
      py::arg("path"), py::arg("to"), Free(),
      "Copies all undamaged rows of a map to a new map, under the same numbers.");
  module.def(
      "compact_map",
      [](const Path& path, std::vector<int> drop_sessions, std::int64_t max_places,
         bool drop_images) {
        if (max_places < 0) {
          throw Error(
              ErrorKind::option,
              fmt::format("max_places is {}, but must be 0 (no limit) or more.", max_places));
        }
        return compact_map(path.string(), {std::move(drop_sessions), max_places, drop_images});
      },
      py::arg("path"), py::kw_only(), whole("drop_sessions") = CompactOptions{}.drop_sessions,
      whole("max_places") = CompactOptions{}.max_places,
      py::arg("drop_images") = CompactOptions{}.drop_images, Free(),
      "Drops sessions with their places and loops, then redundant places above max_places (0 = no "
      "limit), and images if asked, and frees their space. The new file replaces the old one in "
      "one step.");
  py::enum_<ExportFormat>(module, "ExportFormat", "The format of export_loops().")
      .value("csv", ExportFormat::csv, "one row per loop; evaluate() reads it")
      .value("json", ExportFormat::json, "sessions and loops")
      .value("g2o", ExportFormat::g2o, "edges of a pose graph, without poses");
  module.def(
      "export_loops",
      [](SharedReader& map, ExportFormat format) {
        return map.exclusively([&](MapReader& reader) { return export_loops(reader, format); });
      },
      py::arg("map"), py::arg("format"), Free(),
      "The loops of a map as text. Frames are numbered consecutively through all sessions.");
}

}  // namespace loopbit::python
