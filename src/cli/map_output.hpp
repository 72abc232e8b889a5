// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "loopbit/map_file.hpp"

namespace loopbit::cli {

/// Warns on stderr if damaged rows were left out so far.
void warn_of_damage(const MapReader& map);

/// The same for a map that was also written.
void warn_of_damage(const std::string& path, const std::vector<std::string>& damage);

/// Writes images of a map as files SESSION_FRAME.jpg to a new folder, each on first use. The map
/// must outlive it.
class PlaceImages {
 public:
  /// Makes the folder. Throws Error (kind output) if it cannot, or if the folder has files.
  PlaceImages(MapReader& map, const std::string& folder);

  /// The file of an image; empty if the map has no image of the place. Throws Error (kind output).
  std::string file_of(const SessionFrame& at);

  /// Writes all images; returns their number.
  std::size_t write_all();

 private:
  struct PlaceImage {
    std::int64_t id = 0;
    bool is_known = false;  ///< what `file` is
    std::string file = {};
  };

  const std::string& file_of(const SessionFrame& at, PlaceImage& image);

  MapReader& map_;
  std::string folder_;
  std::map<std::pair<int, int>, PlaceImage> images_;  ///< by session and frame
};

}  // namespace loopbit::cli
