// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace loopbit {

/// Tells which images have come to a folder, those that were there at first included.
class FolderWatch {
 public:
  /// Throws Error (kind input) if `folder` is no folder.
  explicit FolderWatch(const std::string& folder);

  /// Paths of the images that are new since the last call, in natural order. A file is given when
  /// neither its size nor its time has changed between two calls, and again only when one has.
  /// Hidden files and files that are no images by their extension are passed over, so that one may
  /// be written as `.name` and renamed. Throws Error (kind input) if the folder cannot be read any
  /// more.
  std::vector<std::string> arrived();

 private:
  struct File {
    std::uintmax_t bytes = 0;
    std::filesystem::file_time_type written = {};
    bool given = false;
  };

  std::string folder_;
  std::map<std::string, File> files_;
};

}  // namespace loopbit
