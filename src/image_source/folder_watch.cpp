// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/folder_watch.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"

#include "sequence_lists.hpp"

namespace loopbit {

namespace fs = std::filesystem;

FolderWatch::FolderWatch(const std::string& folder) : folder_(folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw Error(
        ErrorKind::input,
        fmt::format("'{}' is not a folder; give the folder in which images arrive.", folder));
  }
}

std::vector<std::string> FolderWatch::arrived() {
  std::error_code error;
  fs::directory_iterator entry(folder_, error);
  std::vector<std::string> names;
  std::map<std::string, File> there;
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with('.') || !images::is_image_name(name)) continue;
    std::error_code vanished;
    const std::uintmax_t bytes = fs::file_size(entry->path(), vanished);
    const fs::file_time_type written =
        vanished ? fs::file_time_type() : entry->last_write_time(vanished);
    if (vanished) continue;
    const auto known = files_.find(name);
    const bool is_new = known == files_.end();
    File& file = there[name] = is_new ? File{bytes, written} : known->second;
    const bool settled = !is_new && bytes > 0 && file.bytes == bytes && file.written == written;
    if (!settled) {
      file = {bytes, written};
      continue;
    }
    if (file.given) continue;
    file.given = true;
    names.push_back(name);
  }
  if (error) {
    throw Error(ErrorKind::input,
                fmt::format("The folder '{}' can no longer be read ({}); check that it exists.",
                            folder_, error.message()));
  }
  files_ = std::move(there);  // those that are gone are forgotten
  std::sort(names.begin(), names.end(), images::natural_less);
  for (std::string& name : names) name = (fs::path(folder_) / name).string();
  return names;
}

}  // namespace loopbit
