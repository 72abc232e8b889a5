// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_database.hpp"
#include "loopbit/map_file.hpp"

#include "map_follower.hpp"
#include "session_owners.hpp"

namespace loopbit {

/// The sessions that a new session is compared with: those of a map file, of a server, or of
/// several servers that have the sessions of a map together. The first one has the new session. The
/// others are left out if they do not answer in the beginning. Of a session that two servers have,
/// since it is being moved, one copy counts.
class EarlierSessions {
 public:
  using VisitPlace = std::function<void(const MapPlace&)>;

  /// `paths`: of the databases. `session`: the number of the new one, which has begun. Throws Error
  /// as MapWriter does, and kind option if two servers have different sessions of the same number.
  EarlierSessions(const std::vector<std::string>& paths, int session,
                  const LoopDetectorOptions& options);
  ~EarlierSessions();
  EarlierSessions(const EarlierSessions&) = delete;
  EarlierSessions& operator=(const EarlierSessions&) = delete;
  EarlierSessions(EarlierSessions&&) = delete;
  EarlierSessions& operator=(EarlierSessions&&) = delete;

  /// By number, with those that news() told of.
  [[nodiscard]] const std::map<int, MapSession>& sessions() const { return sessions_; }

  /// Whether it is on a server that this session only reads.
  [[nodiscard]] bool is_elsewhere(int session) const { return owner(session) > 0; }

  /// The address of the server that has it.
  [[nodiscard]] const std::string& server_of(int session) const;

  /// Of the sessions in the first database when this one began.
  [[nodiscard]] std::int64_t first_frames() const { return first_frames_; }

  /// In order of session and frame. Throws Error (kind input) if the first database is damaged; the
  /// next one, too.
  void for_each_place(const VisitPlace& visit);

  /// By session of the query, then in the order in which they were found.
  std::vector<MapLoop> loops();

  /// Call this when the two functions above are not called any more.
  void end_snapshots();

  /// Of a map on one server; 0 otherwise.
  [[nodiscard]] std::int64_t epoch() const;

  /// What others added meanwhile. A session that is moved is no news.
  MapFollower::News news();

  /// Of the place with the key `key`, which is place `at`. Empty if they are damaged. Null if a
  /// server does not give them in time: a frame waits at most a second in all.
  std::shared_ptr<const Features> features(std::int64_t key, const SessionFrame& at);

  /// Call this before each frame.
  void begin_frame() { waited_ = {}; }

  /// With the name of their server, if there are several.
  [[nodiscard]] std::vector<std::string> damage() const;

  /// Of several servers, those that did not answer, in the beginning or for a while.
  [[nodiscard]] const std::set<std::string>& not_asked() const { return not_asked_; }

  /// Sentences on servers but the first, since the last call.
  std::vector<std::string> take_notices();

 private:
  struct Source;

  void open_others(const std::vector<std::string>& paths);
  void begin_snapshots();
  [[nodiscard]] std::vector<ServerSessions> read_sessions_of_all();
  void check(const LoopDetectorOptions& options) const;
  void follow(const LoopDetectorOptions& options);
  [[nodiscard]] std::size_t owner(int session) const;
  template <typename Work>
  bool ask(Source& source, const Work& work);
  void leave_out(const std::string& server, const std::string& why);
  void visit_session(int session, Source& source, const VisitPlace& visit);
  void take_news(std::size_t number, MapFollower::News& all);

  int session_;
  std::vector<std::unique_ptr<Source>> sources_;
  std::map<int, MapSession> sessions_;
  std::map<int, std::size_t> owners_;  ///< numbers of sources, by session; missing = the first
  std::map<int, int> last_frames_;     ///< that were visited or news, by session
  std::int64_t first_frames_ = 0;
  std::chrono::nanoseconds waited_{};  ///< for features, since begin_frame()
  std::set<std::string> not_asked_;
  std::vector<std::string> notices_;
};

}  // namespace loopbit
