// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "loopbit/database.hpp"
#include "loopbit/map_tools.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// Writes sessions, places and loops of one map into another.
class MapCopy {
 public:
  /// `numbers`: what each session is called in `to`; those not named are left out.
  MapCopy(const Database& to, std::map<int, int> numbers);

  void copy_session(MapSession session);

  /// The two below: false if a session of theirs is left out.
  bool copy_place(const MapPlace& place, const Features& features);
  bool copy_loop(MapLoop loop);

 private:
  [[nodiscard]] bool renumber(SessionFrame& at) const;

  RowWriter rows_;
  std::map<int, int> numbers_;
};

/// Copies `sessions`, their loops, and of their places those that `keeps` takes, to a new map that
/// nobody can see yet, under the same numbers. Says what was copied.
MapCheck copy_whole(MapReader& from, const std::vector<MapSession>& sessions, const Database& to,
                    const std::function<bool(const MapPlace&)>& keeps);

}  // namespace loopbit
