// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "earlier_sessions.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/map_server.hpp"

#include "file_database.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "server_features.hpp"
#include "server_limits.hpp"

namespace loopbit {
namespace {

/// A frame waits no longer for features from servers.
constexpr std::chrono::milliseconds kMaxWait{1000};

}  // namespace

/// A database.
struct EarlierSessions::Source {
  explicit Source(std::string address)
      : path(std::move(address)), database(open_map(path, MapDatabase::Access::read)) {}

  [[nodiscard]] const std::string& shown() const { return database->path(); }

  std::string path;
  std::unique_ptr<MapDatabase> database;
  std::unique_ptr<MapDatabase::Transaction> snapshot = nullptr;
  std::vector<MapSession> sessions = {};  ///< in the snapshot
  std::int64_t epoch = 0;                 ///< of the snapshot
  std::set<int> other_sessions = {};      ///< whose numbers others have, too
  Damage damage = {};
  std::optional<FeatureReader> reader = std::nullopt;  ///< of a map file

  // Of a server.
  std::unique_ptr<MapFollower> follower = nullptr;
  std::unique_ptr<ServerFeatures> features = nullptr;
};

EarlierSessions::EarlierSessions(const std::vector<std::string>& paths, int session,
                                 const LoopDetectorOptions& options)
    : session_(session) {
  sources_.push_back(std::make_unique<Source>(paths.front()));
  open_others(paths);
  begin_snapshots();
  check(options);
  follow(options);
}

EarlierSessions::~EarlierSessions() = default;

void EarlierSessions::open_others(const std::vector<std::string>& paths) {
  for (std::size_t i = 1; i < paths.size(); ++i) {
    try {
      sources_.push_back(std::make_unique<Source>(paths[i]));
      sources_.back()->database->set_time_limit(kMaxAnswer);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input) throw;
      leave_out(without_secrets(paths[i]), error.what());
    }
  }
}

void EarlierSessions::leave_out(const std::string& server, const std::string& why) {
  not_asked_.insert(server);
  notices_.push_back(why);
}

/// False if `work` fails, because a server that is not the first one does not answer.
template <typename Work>
bool EarlierSessions::ask(Source& source, const Work& work) {
  try {
    work();
    return true;
  } catch (const Error& error) {
    if (&source == sources_.front().get() || error.kind() != ErrorKind::input) throw;
    leave_out(source.shown(), error.what());
    return false;
  }
}

void EarlierSessions::begin_snapshots() {
  std::set<int> before;
  if (sources_.size() > 1) before = numbers_of(read_sessions_of_all());
  take_snapshots(std::move(before), [this] {
    for (const auto& source : sources_) {
      ask(*source, [&] {
        source->snapshot.reset();
        source->snapshot = source->database->snapshot();
        source->epoch = source->database->epoch();
      });
    }
    return numbers_of(read_sessions_of_all());
  });
  std::vector<ServerSessions> all;
  for (const auto& source : sources_) all.push_back({source->shown(), source->sessions});
  // Another server may have a session with its number.
  all.front().sessions.emplace_back().session = session_;
  owners_ = owners_of(all);
  for (const auto& [number, owner] : owners_) {
    const auto found = std::ranges::find(sources_[owner]->sessions, number, &MapSession::session);
    if (number != session_) sessions_[number] = *found;
  }
  for (const MapSession& session : sources_.front()->sessions) {
    if (session.session < session_) first_frames_ += session.frames;
  }
}

/// Without servers that do not answer, which are left out from then on.
std::vector<ServerSessions> EarlierSessions::read_sessions_of_all() {
  std::vector<ServerSessions> all;
  for (auto next = sources_.begin(); next != sources_.end();) {
    Source& source = **next;
    if (ask(source, [&] { source.sessions = read_sessions(*source.database, source.damage); })) {
      all.push_back({source.shown(), source.sessions});
      ++next;
    } else {
      next = sources_.erase(next);
    }
  }
  return all;
}

void EarlierSessions::check(const LoopDetectorOptions& options) const {
  for (const auto& source : sources_) {
    for (const MapSession& session : source->sessions) {
      check_same_shape(source->shown(), session.options, options);
    }
  }
}

/// Begins to learn what others add to what the snapshots have.
void EarlierSessions::follow(const LoopDetectorOptions& options) {
  for (const auto& source : sources_) {
    const auto open = [&] { return open_map(source->path, MapDatabase::Access::read); };
    if (!is_map_address(source->path)) {
      source->reader.emplace(*source->database);
      continue;
    }
    std::set<int> known;
    for (const MapSession& session : source->sessions) known.insert(session.session);
    source->follower =
        std::make_unique<MapFollower>(open(), session_, source->epoch, std::move(known),
                                      [path = source->shown(), options](const MapSession& session) {
                                        check_same_shape(path, session.options, options);
                                      });
    source->features = std::make_unique<ServerFeatures>(open(), *source->database);
  }
}

std::size_t EarlierSessions::owner(int session) const {
  const auto found = owners_.find(session);
  return found == owners_.end() ? 0 : found->second;
}

const std::string& EarlierSessions::server_of(int session) const {
  return sources_[owner(session)]->shown();
}

void EarlierSessions::for_each_place(const VisitPlace& visit) {
  const VisitPlace note_and_visit = [&](const MapPlace& place) {
    last_frames_[place.at.session] = place.at.frame;
    visit(place);
  };
  Source& first = *sources_.front();
  if (sources_.size() == 1) {
    loopbit::for_each_place(*first.database, note_and_visit, first.damage);
  } else {
    for (const auto& [session, number] : owners_) {
      visit_session(session, *sources_[number], note_and_visit);
    }
  }
  refuse_damaged(first.shown(), first.damage.clauses());
}

/// All of it, or nothing if its server is lost.
void EarlierSessions::visit_session(int session, Source& source, const VisitPlace& visit) {
  std::vector<MapPlace> places;
  const bool is_whole = ask(source, [&] {
    loopbit::for_each_place(
        *source.database, [&](const MapPlace& place) { places.push_back(place); }, source.damage,
        places_of(*source.database, session));
  });
  if (is_whole) std::ranges::for_each(places, visit);
}

std::vector<MapLoop> EarlierSessions::loops() {
  std::vector<MapLoop> all;
  for (std::size_t number = 0; number < sources_.size(); ++number) {
    Source& source = *sources_[number];
    ask(source, [&] {
      for (const MapLoop& loop : read_loops(*source.database, source.damage)) {
        if (owner(loop.query.session) == number) all.push_back(loop);
      }
    });
  }
  refuse_damaged(sources_.front()->shown(), sources_.front()->damage.clauses());
  if (sources_.size() > 1) {
    std::ranges::stable_sort(all, {}, [](const MapLoop& loop) { return loop.query.session; });
  }
  return all;
}

void EarlierSessions::end_snapshots() {
  for (const auto& source : sources_) source->snapshot.reset();
}

std::int64_t EarlierSessions::epoch() const {
  return sources_.size() == 1 ? sources_.front()->epoch : 0;
}

MapFollower::News EarlierSessions::news() {
  MapFollower::News all;
  for (std::size_t number = 0; number < sources_.size(); ++number) {
    if (sources_[number]->follower) take_news(number, all);
  }
  if (sources_.size() > 1) all.epoch = 0;
  return all;
}

void EarlierSessions::take_news(std::size_t number, MapFollower::News& all) {
  Source& source = *sources_[number];
  MapFollower::News found = source.follower->take();
  all.epoch = found.epoch;
  if (number > 0 && !found.notices.empty()) {  // of the first one, the upload says so
    not_asked_.insert(source.shown());
    std::ranges::move(found.notices, std::back_inserter(notices_));
  }
  for (const MapSession& session : found.sessions) {
    const auto [known, is_new] = sessions_.try_emplace(session.session, session);
    if (is_new) {
      owners_[session.session] = number;
      all.sessions.push_back(session);
    } else if (known->second.uid != session.uid) {
      source.other_sessions.insert(session.session);
    }
  }
  // A session that was moved here comes with loops that are known.
  const auto take = [&](const std::vector<MapLoop>& loops, std::vector<MapLoop>& to) {
    std::ranges::copy_if(loops, std::back_inserter(to),
                         [&](const MapLoop& loop) { return owner(loop.query.session) == number; });
  };
  take(found.loops, all.loops);
  take(found.rejected, all.rejected);
  for (const MapPlace& place : found.places) {
    if (source.other_sessions.contains(place.at.session)) continue;
    owners_[place.at.session] = number;
    int& last = last_frames_.try_emplace(place.at.session, -1).first->second;
    if (place.at.frame <= last) continue;
    last = place.at.frame;
    all.places.push_back(place);
  }
}

std::shared_ptr<const Features> EarlierSessions::features(std::int64_t key,
                                                          const SessionFrame& at) {
  Source& source = *sources_[owner(at.session)];
  if (source.reader) {
    auto read = source.reader->read(key, at, source.damage);
    return std::make_shared<const Features>(read ? std::move(*read) : Features{});
  }
  if (waited_ >= kMaxWait) return nullptr;
  const auto begin = std::chrono::steady_clock::now();
  auto features = source.features->take(key, at, kMaxWait - waited_, source.damage);
  waited_ += std::chrono::steady_clock::now() - begin;
  return features;
}

std::vector<std::string> EarlierSessions::damage() const {
  if (sources_.size() == 1) return sources_.front()->damage.clauses();
  std::vector<std::string> all;
  for (const auto& source : sources_) {
    for (const std::string& clause : source->damage.clauses()) {
      all.push_back(fmt::format("'{}': {}", source->shown(), clause));
    }
  }
  return all;
}

std::vector<std::string> EarlierSessions::take_notices() { return std::exchange(notices_, {}); }

}  // namespace loopbit
