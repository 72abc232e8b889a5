// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "image_names.hpp"

#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"

namespace loopbit {

std::map<std::string, std::filesystem::path> images_by_stem(const std::string& folder,
                                                            const char* what) {
  using std::filesystem::directory_iterator;
  std::map<std::string, std::filesystem::path> files;
  std::error_code error;
  for (directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::filesystem::path& file = at->path();
    if (images::is_image_name(file)) files[file.stem().string()] = file;
  }
  if (!error) return files;
  throw Error(ErrorKind::input, fmt::format("The folder of {} '{}' cannot be read ({}).", what,
                                            folder, error.message()));
}

}  // namespace loopbit
