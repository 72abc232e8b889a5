// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/map_tools.hpp"
#include "loopbit/printable.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

/// A loop with the numbers of its frames, counted through all sessions.
struct ExportedLoop {
  std::int64_t query = 0;
  std::int64_t match = 0;
  MapLoop loop;
  KnownMotion motion;  ///< from match to query
};

/// Loops of dropped sessions are left out.
std::vector<ExportedLoop> edges_of(MapReader& map) {
  std::map<int, std::int64_t> first_frame;
  std::int64_t frames = 0;
  for (const MapSession& session : map.sessions()) {
    first_frame[session.session] = std::exchange(frames, frames + session.frames);
  }
  std::vector<ExportedLoop> edges;
  const std::vector<MapLoop> loops = map.loops();
  const std::vector<KnownMotion> motions = map.motions_of(loops);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const MapLoop& loop = loops[i];
    const auto query = first_frame.find(loop.query.session);
    const auto match = first_frame.find(loop.match.session);
    if (query == first_frame.end() || match == first_frame.end()) continue;
    edges.push_back(
        {query->second + loop.query.frame, match->second + loop.match.frame, loop, motions[i]});
  }
  return edges;
}

std::string csv(const std::vector<ExportedLoop>& edges) {
  std::string text =
      "query,match,score,query_session,query_frame,match_session,match_frame,similarity,matches,"
      "inliers\n";
  for (const auto& [query, match, loop, motion] : edges) {
    text += fmt::format("{},{},{},{},{},{},{},{:.6f},{},{}\n", query, match, loop.score,
                        loop.query.session, loop.query.frame, loop.match.session, loop.match.frame,
                        loop.similarity, loop.matches, loop.inliers);
  }
  return text;
}

Json to_json(const SessionFrame& at) { return {{"session", at.session}, {"frame", at.frame}}; }

std::string json(const MapReader& map, const std::vector<ExportedLoop>& edges) {
  Json json{{"sessions", Json::array()}, {"loops", Json::array()}};
  for (const MapSession& session : map.sessions()) {
    json["sessions"].push_back({{"session", session.session},
                                {"uid", session.uid},
                                {"name", session.name},
                                {"started", session.started},
                                {"frames", session.frames}});
  }
  for (const auto& [query, match, loop, motion] : edges) {
    json["loops"].push_back({{"query", to_json(loop.query)},
                             {"match", to_json(loop.match)},
                             {"score", loop.score},
                             {"similarity", loop.similarity},
                             {"matches", loop.matches},
                             {"inliers", loop.inliers}});
  }
  return printable_json(json.dump(2, ' ', false, Json::error_handler_t::replace)) + '\n';
}

/// g2o's text format (github.com/RainerKuemmerle/g2o, "File format"): one vertex or edge per line.
/// Edges that were not measured are identities.
std::string g2o(const std::vector<ExportedLoop>& edges) {
  constexpr const char* kIdentityPose = "0 0 0 0 0 0 1";
  constexpr const char* kIdentityInformation = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";
  std::set<std::int64_t> frames;
  for (const ExportedLoop& edge : edges) frames.insert({edge.query, edge.match});
  std::string text;
  for (const std::int64_t frame : frames) {
    text += fmt::format("VERTEX_SE3:QUAT {} {}\n", frame, kIdentityPose);
  }
  for (const ExportedLoop& edge : edges) {
    text += edge.motion.known == PoseKnown::nothing
                ? fmt::format("EDGE_SE3:QUAT {} {} {} {}", edge.match, edge.query, kIdentityPose,
                              kIdentityInformation)
                : to_g2o_edge(edge.motion, edge.match, edge.query);
    text += '\n';
  }
  return text;
}

}  // namespace

std::string export_loops(MapReader& map, ExportFormat format) {
  const std::vector<ExportedLoop> edges = edges_of(map);
  switch (format) {
    case ExportFormat::csv:
      return csv(edges);
    case ExportFormat::json:
      return json(map, edges);
    case ExportFormat::g2o:
      return g2o(edges);
  }
  return "";
}

}  // namespace loopbit
