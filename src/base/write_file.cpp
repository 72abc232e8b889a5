// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/write_file.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

namespace loopbit {

namespace fs = std::filesystem;

namespace {

bool write_all(const fs::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  return !file.fail();
}

}  // namespace

void write_file(const std::string& path, std::string_view bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    if (!write_all(path, bytes)) throw cannot_write(path, errno);
    return;
  }
  if (error == std::errc::too_many_symbolic_link_levels) throw cannot_write(path, error.value());
  const fs::path target = resolved_path(path);
  fs::path part = target;
  part += ".part";
  const bool written = write_all(part, bytes);
  if (written) fs::rename(part, target, error);
  if (!written || error) {
    const int reason = written ? error.value() : errno;
    fs::remove(part, error);
    throw cannot_write(path, reason);
  }
}

void make_new_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  const bool is_empty = !error && fs::is_empty(folder, error);
  if (error) throw cannot_write(folder, error.value());
  if (is_empty) return;
  throw Error(ErrorKind::output,
              fmt::format("'{}' has files that could be replaced; give a new folder.", folder));
}

std::string resolved_path(const std::string& path) {
  constexpr int kMaxLinks = 40;  // as many as Linux follows
  std::error_code error;
  fs::path file = path;
  // One by one: weakly_canonical() does not follow a link to what is yet to be made.
  for (int links = 0; links < kMaxLinks && fs::is_symlink(file, error); ++links) {
    file = file.parent_path() / fs::read_symlink(file, error);
  }
  file = fs::weakly_canonical(file, error);
  return error ? path : file.string();
}

Error cannot_write(const std::string& path, int errno_value, const std::string& kept) {
  return {ErrorKind::output,
          fmt::format("Cannot write '{}': {}; check the folder, its permissions and the free "
                      "space.{}",
                      path, std::strerror(errno_value), kept)};
}

}  // namespace loopbit
