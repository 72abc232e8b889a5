// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/write_file.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "loopbit/error.hpp"

namespace loopbit {

void write_file(const std::string& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  const fs::path part = path + ".part";
  std::ofstream file(part, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  std::error_code error;
  if (file) fs::rename(part, path, error);
  if (!file || error) {
    const int reason = error ? error.value() : errno;
    fs::remove(part, error);
    throw cannot_write(path, reason);
  }
}

}  // namespace loopbit
