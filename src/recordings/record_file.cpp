// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "record_file.hpp"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit::recordings {

RecordFile::RecordFile(const std::filesystem::path& path) : stream_(path, std::ios::binary) {
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) {
    size_ = std::filesystem::file_size(path, error);
    if (!error && stream_) return;
  }
  throw Error(ErrorKind::input,
              fmt::format("Recording '{}' cannot be read{}: check the path and its permissions.",
                          path.string(), error ? fmt::format(" ({})", error.message()) : ""));
}

Bytes RecordFile::read(std::uint64_t at, std::size_t count) {
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, left(at)));
  if (buffer_.size() < count) buffer_.resize(count);
  stream_.clear();
  if (at != position_) stream_.seekg(static_cast<std::streamoff>(at));
  stream_.read(reinterpret_cast<char*>(buffer_.data()), static_cast<std::streamsize>(count));
  const auto got = static_cast<std::size_t>(stream_.gcount());
  position_ = at + got;
  return Bytes(buffer_).first(got);
}

}  // namespace loopbit::recordings
