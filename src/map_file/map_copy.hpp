// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/database.hpp"
#include "loopbit/map_tools.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// The bytes of a place's image, if there is one.
using Image = std::optional<std::vector<unsigned char>>;

/// Writes sessions, places and loops of one map into another.
class MapCopy {
 public:
  /// `numbers`: what each session is called in `to`; those not named are left out.
  MapCopy(const Database& to, std::map<int, int> numbers);

  void copy_session(MapSession session);

  /// The two below: false if a session of theirs is left out.
  bool copy_place(const MapPlace& place, const Features& features, const Image& image);
  bool copy_loop(MapLoop loop);

 private:
  [[nodiscard]] bool renumber(SessionFrame& at) const;

  RowWriter rows_;
  std::map<int, int> numbers_;
};

/// What of a map is copied.
struct CopyPlan {
  std::vector<MapSession> sessions;  ///< with their loops
  std::function<bool(const MapPlace&)> keeps_place;
  bool keeps_images = true;
};

/// Copies what is planned to a new map that nobody can see yet, under the same numbers. Says what
/// was copied.
MapCheck copy_whole(MapReader& from, const CopyPlan& plan, const Database& to);

}  // namespace loopbit
