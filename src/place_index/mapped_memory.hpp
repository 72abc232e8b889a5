// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

namespace loopbit {

/// Zeroed memory straight from the system: it takes no room before it is written to, and never
/// moves.
class MappedMemory {
 public:
  /// Throws std::bad_alloc.
  explicit MappedMemory(std::size_t size_bytes) : MappedMemory(size_bytes, -1, 0) {}
  ~MappedMemory();
  MappedMemory(const MappedMemory&) = delete;
  MappedMemory& operator=(const MappedMemory&) = delete;
  MappedMemory(MappedMemory&& other) noexcept;
  MappedMemory& operator=(MappedMemory&& other) noexcept;

  [[nodiscard]] void* data() const { return data_; }

  /// Lets the system use large pages, which large memory is read faster through, but which take
  /// room by 2 MB.
  void prefer_large_pages();

 private:
  friend class ScratchFile;
  MappedMemory(std::size_t size_bytes, int file, std::size_t offset_bytes);

  std::size_t size_bytes_;
  void* data_;
};

/// A file without a name that memory can be mapped to. It is gone when this is, or with the
/// process.
class ScratchFile {
 public:
  /// Throws Error (kind output) if no file can be made in `folder`.
  explicit ScratchFile(const std::string& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  ScratchFile(ScratchFile&&) = delete;
  ScratchFile& operator=(ScratchFile&&) = delete;

  /// The next `size_bytes` of the file, a multiple of the page size. Throws Error (kind output) if
  /// the disk is full: room is taken now, so that writing cannot fail later.
  MappedMemory extend(std::size_t size_bytes);

 private:
  std::string folder_;
  int descriptor_ = -1;
  std::size_t size_bytes_ = 0;
};

}  // namespace loopbit
