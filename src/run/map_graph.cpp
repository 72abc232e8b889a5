// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_graph.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

#include "session_graph.hpp"

namespace loopbit {
namespace {

/// Throws Error (kind input) if no frame has odometry.
void add_frames(MapReader& map, SessionGraph& graph) {
  std::set<int> sessions;
  for (const MapSession& session : map.sessions()) sessions.insert(session.session);
  for (const MapOdometry& frame : map.odometry()) {
    if (!sessions.contains(frame.at.session)) continue;
    graph.add_frame(frame.at, frame.timestamp_s, frame.pose);
  }
  if (!graph.keyframes().empty()) return;
  throw Error(ErrorKind::input,
              fmt::format("'{0}' has no odometry, so there is no trajectory to correct: record "
                          "sessions with 'loopbit run INPUT --map {0} --odometry FILE'.",
                          map.path()));
}

/// Adds the loops, and returns those that are judged.
std::vector<MapLoop> add_loops(MapReader& map, SessionGraph& graph) {
  std::vector<MapLoop> loops = map.loops();
  std::ranges::stable_sort(loops, {}, [](const MapLoop& loop) {
    return std::pair(loop.query.session, loop.query.frame);
  });
  const std::vector<KnownMotion> motions = map.motions_of(loops);
  std::vector<MapLoop> judged;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (graph.add_loop(loops[i].query, loops[i].match, motions[i])) judged.push_back(loops[i]);
  }
  return judged;
}

std::vector<MapCorrection::Session> sessions_of(const MapReader& map, const SessionGraph& graph) {
  std::map<int, MapCorrection::Session> corrected;
  for (std::size_t k = 0; k < graph.keyframes().size(); ++k) {
    MapCorrection::Session& session = corrected[graph.keyframes()[k].at.session];
    ++session.keyframes;
    session.frame_of = graph.world_of(k);
  }
  std::vector<MapCorrection::Session> sessions;
  for (const MapSession& session : map.sessions()) {
    sessions.push_back(corrected[session.session]);
    sessions.back().session = session.session;
  }
  return sessions;
}

}  // namespace

MapCorrection correct_map(MapReader& map, const std::string& folder) {
  SessionGraph graph;
  add_frames(map, graph);
  const std::vector<MapLoop> loops = add_loops(map, graph);
  graph.solve();
  if (!folder.empty()) {
    make_new_folder(folder);
    std::map<int, std::int64_t> frames;
    for (const MapSession& session : map.sessions()) frames[session.session] = session.frames;
    graph.write(folder, frames);
  }
  MapCorrection result{
      .correction = graph.results(), .sessions = sessions_of(map, graph), .rejected = {}};
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (graph.loops()[i].verdict != LoopVerdict::kept) result.rejected.push_back(loops[i]);
  }
  return result;
}

}  // namespace loopbit
