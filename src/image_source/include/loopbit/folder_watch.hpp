// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace loopbit {

/// Reports the images of a folder, first the existing ones, then new ones as they arrive.
class FolderWatch {
 public:
  /// Throws Error (kind input) if `folder` is not a folder.
  explicit FolderWatch(const std::string& folder);

  /// Paths of the images that are new since the last call, in natural order. A file is reported
  /// when its size and its time have not changed between two calls, and again only after a change.
  /// Hidden files and files without an image extension are skipped, so a writer may write `.name`
  /// and rename it. Throws Error (kind input) if the folder can no longer be read.
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
