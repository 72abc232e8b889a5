// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/map_tools.hpp"

#include "map_copy.hpp"
#include "map_log.hpp"
#include "map_options.hpp"
#include "map_schema.hpp"

namespace loopbit {
namespace {

/// Which sessions go where.
struct MergePlan {
  std::map<int, int> numbers;     ///< of each session in the other map: in this one
  std::vector<MapSession> added;  ///< those that this one lacks
  std::int64_t known = 0;         ///< the others
};

/// Throws Error (kind option) where settings differ.
MergePlan plan_of(const std::string& into, const Database& to, const MapReader& source) {
  Damage damage;
  std::map<std::string, int> known;
  std::string options;
  for (const MapSession& session : read_sessions(to, damage)) {
    known[session.uid] = session.session;
    options = session.options;
  }
  refuse_damaged(into, damage.clauses());  // a session of unknown uid would be added twice
  MergePlan plan;
  int next = next_session(to);
  for (const MapSession& session : source.sessions()) {
    if (options.empty()) options = session.options;
    check_same_shape(into, options, options_of_shape(source.path(), session.options));
    const auto found = known.find(session.uid);
    const bool is_known = found != known.end();
    plan.numbers[session.session] = is_known ? found->second : next++;
    if (is_known) {
      ++plan.known;
    } else {
      plan.added.push_back(session);
    }
  }
  return plan;
}

/// A session that is not whole would be taken for known by the next merge.
void refuse_unfinished(const std::string& from) {
  if (!is_being_written(from)) return;
  throw Error(ErrorKind::input, fmt::format("'{}' is being written: only a part of its session "
                                            "would be copied; merge it when its run has ended.",
                                            from));
}

/// Adds what `into` does not have of `source`, in one transaction.
MergeCounts merge(const std::string& into, const Database& to, MapReader& source) {
  const MergePlan plan = plan_of(into, to, source);
  std::set<int> added;
  for (const MapSession& session : plan.added) added.insert(session.session);

  MergeCounts counts{.sessions = static_cast<std::int64_t>(added.size()), .known = plan.known};
  if (!has_log(to)) {  // or readers would have to wait for the whole commit
    mark(to);
    begin_log(to);
  }
  Commit commit(to);
  MapCopy copy(to, plan.numbers);
  std::int64_t id = next_place(to);
  for (const MapSession& session : plan.added) copy.copy_session(session);
  source.for_each_place([&](const MapPlace& place) {
    if (!added.contains(place.at.session)) return;
    const auto features = source.features_of(place);
    if (!features) return;
    MapPlace copied = place;
    copied.id = id++;
    counts.places += copy.copy_place(copied, *features, source.image_of(place));
  });
  for (const MapLoop& loop : source.loops()) {
    if (added.contains(loop.query.session)) counts.loops += copy.copy_loop(loop);
  }
  refuse_damaged(source.path(), source.damage());
  commit.end();
  return counts;
}

}  // namespace

MergeCounts merge_map(const std::string& into, const std::string& from) {
  auto source = std::make_unique<MapReader>(from);
  refuse_unfinished(from);
  const Database to = open_map_for_writing(into);
  try {
    const MergeCounts counts = merge(into, to, *source);
    source.reset();  // it may read the same map
    close_log(to);
    return counts;
  } catch (const Error&) {
    source.reset();
    close_log(to);
    throw;
  }
}

}  // namespace loopbit
