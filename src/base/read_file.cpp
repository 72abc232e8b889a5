// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/read_file.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw Error(ErrorKind::input, fmt::format("'{}' {}.", path, what));
}

[[noreturn]] void fail_unreadable(const std::string& path, int errno_value) {
  fail(path, fmt::format("cannot be read ({}): check its permissions",
                         std::generic_category().message(errno_value)));
}

void check_regular(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) fail(path, "does not exist: correct the path");
  if (error) fail_unreadable(path, error.value());
  if (fs::is_directory(status)) fail(path, "is a folder: name a file");
  if (!fs::is_regular_file(status)) {
    fail(path, "is a pipe or a device: write its content to a file, and name that");
  }
}

}  // namespace

std::string read_file(const std::string& path, std::uintmax_t max_bytes) {
  check_regular(path);
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail_unreadable(path, errno);
  std::string bytes;
  // Not by the size the system tells, which is 0 in /proc.
  while (stream && bytes.size() <= max_bytes) {
    constexpr std::size_t kStep = std::size_t{1} << 20U;
    const std::size_t before = bytes.size();
    bytes.resize(before + kStep);
    stream.read(bytes.data() + before, kStep);
    bytes.resize(before + static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) fail_unreadable(path, errno);
  if (bytes.size() > max_bytes) {
    fail(path, fmt::format("has more than {} bytes, the most that is read of such a file: split "
                           "it, or name another",
                           max_bytes));
  }
  return bytes;
}

std::string read_text(const std::string& path, std::uintmax_t max_bytes) {
  std::string text = read_file(path, max_bytes);
  const std::size_t at = text.find('\0');
  if (at == std::string::npos) return text;
  const auto line =
      1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  fail(path, fmt::format("is not plain text: it holds a NUL byte in line {}; save it as UTF-8 text",
                         line));
}

}  // namespace loopbit
