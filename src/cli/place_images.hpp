// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "loopbit/map_file.hpp"

namespace loopbit::cli {

/// A map's images as files SESSION_FRAME.jpg in a folder of their own, each written when first
/// asked for. The map must outlive it.
class PlaceImages {
 public:
  /// Makes the folder. Throws Error (kind output) if it cannot, or if the folder has files.
  PlaceImages(MapReader& map, const std::string& folder);

  /// The image's file; empty if the map has none of that place. Throws Error (kind output).
  std::string file_of(const SessionFrame& at);

  /// Writes all; returns how many there are.
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
