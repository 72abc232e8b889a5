// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "loopbit/map_graph.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/printable.hpp"

#include "commands.hpp"
#include "map_output.hpp"
#include "process.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

using Json = nlohmann::ordered_json;

struct GraphFlags {
  std::string map;
  std::string out;
  bool reject = false;
  bool json = false;
};

Json json_of(const SessionFrame& at) { return {{"session", at.session}, {"frame", at.frame}}; }

void print_json(const MapCorrection& result, const GraphFlags& flags) {
  const Correction& correction = result.correction;
  Json loops = Json::object();
  for (std::size_t i = 0; i < kAllLoopVerdicts.size(); ++i) {
    if (kAllLoopVerdicts[i] == LoopVerdict::undecided) continue;
    loops[std::string(to_string(kAllLoopVerdicts[i]))] = correction.by_verdict[i];
  }
  Json json{{"map", flags.map},
            {"keyframes", correction.keyframes},
            {"loops", loops},
            {"unjudged_loops", correction.unjudged},
            {"sessions", Json::array()},
            {"rejected", Json::array()},
            {"moved", flags.reject}};
  for (const MapCorrection::Session& session : result.sessions) {
    json["sessions"].push_back(
        {{"session", session.session},
         {"keyframes", session.keyframes},
         {"frame_of", session.keyframes > 0 ? Json(session.frame_of) : Json()}});
  }
  for (const MapLoop& loop : result.rejected) {
    json["rejected"].push_back({{"query", json_of(loop.query)}, {"match", json_of(loop.match)}});
  }
  print_document(json);
}

/// Which sessions have their corrected poses in one frame, and which have none.
void print_sessions(const std::vector<MapCorrection::Session>& sessions) {
  std::map<int, std::vector<int>> by_frame;
  for (const MapCorrection::Session& session : sessions) {
    by_frame[session.frame_of].push_back(session.session);
  }
  for (const auto& [frame, members] : by_frame) {
    const char* plural = members.size() == 1 ? "" : "s";
    const std::string list = fmt::format("session{} {}", plural, fmt::join(members, ", "));
    if (frame == 0) {
      fmt::print("           {} without odometry\n", list);
    } else if (members.size() > 1) {
      fmt::print("           {} joined by loops, in the frame of session {}\n", list, frame);
    } else if (sessions.size() > 1) {
      fmt::print("           {} joined to no other, in a frame of its own\n", list);
    }
  }
}

void print_summary(const MapCorrection& result, const GraphFlags& flags) {
  const Correction& correction = result.correction;
  fmt::print("map        {}, {}, {} with odometry\n", printable(flags.map),
             counted(result.sessions.size(), "session"), counted(correction.keyframes, "frame"));
  print_sessions(result.sessions);
  fmt::print("graph      {} kept, {} rejected{}\n", counted(correction.kept(), "loop"),
             correction.rejected(), evidence_text(correction));
  if (correction.unjudged > 0) {
    fmt::print("           not judged: {} of frames without odometry\n",
               counted(correction.unjudged, "loop"));
  }
  if (!flags.out.empty()) {
    fmt::print("written    {0}/corrected_SESSION.tum, {0}/graph.g2o, {0}/judged_loops.csv\n",
               printable(flags.out));
  }
  if (result.rejected.empty()) return;
  if (flags.reject) {
    fmt::print("rejected   {}, also in the map\n", counted(result.rejected.size(), "loop"));
  } else {
    fmt::print("next       loopbit graph {} --reject withdraws the rejected loops in the map\n",
               printable(flags.map));
  }
}

void graph_command(const GraphFlags& flags) {
  MapCorrection result;
  GraphFlags shown = flags;
  {
    MapReader map(flags.map);
    shown.map = map.path();  // without a password
    result = correct_map(map, flags.out);
    warn_of_damage(map);
  }
  if (flags.reject) reject_loops(flags.map, result.rejected);
  flags.json ? print_json(result, shown) : print_summary(result, shown);
}

}  // namespace

void add_graph(CLI::App& app) {
  auto flags = std::make_shared<GraphFlags>();
  CLI::App* command = app.add_subcommand(
      "graph", "Correct the trajectories of a map's sessions, and judge its loops");
  command
      ->add_option("MAP", flags->map, "A map written by 'loopbit run --map MAP.db --odometry FILE'")
      ->required();
  command
      ->add_option("--out", flags->out,
                   "A new folder for corrected_SESSION.tum, graph.g2o, trajectory.csv and "
                   "judged_loops.csv; see docs/run_folder.md")
      ->type_name("DIR");
  command->add_flag("--reject", flags->reject,
                    "Withdraw the rejected loops in the map; otherwise it is only read");
  command->add_flag("--json", flags->json, "Print JSON");
  command->callback([flags] { graph_command(*flags); });
}

}  // namespace loopbit::cli
