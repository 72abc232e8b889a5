// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "loopbit/error.hpp"

namespace loopbit::fuzz {

/// Gives `read` the path of a file that ends in `extension` and holds the bytes. A reader may give
/// values or throw Error; anything else is a finding.
template <typename Read>
void read_as_file(const std::uint8_t* data, std::size_t size, const char* extension, Read read) {
  namespace fs = std::filesystem;
  static const std::string path =
      (fs::temp_directory_path() / fmt::format("loopbit_fuzz_{}{}", getpid(), extension)).string();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    read(path);
  } catch (const Error&) {  // refused, as it should be
  }
  std::error_code error;
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) fs::remove(path + suffix, error);
}

}  // namespace loopbit::fuzz
