// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "mapped_memory.hpp"

#include <cerrno>
#include <cstdlib>
#include <new>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit {

MappedMemory::MappedMemory(std::size_t size_bytes, int file, std::size_t offset_bytes)
    : size_bytes_(size_bytes),
      data_(::mmap(nullptr, size_bytes, PROT_READ | PROT_WRITE,
                   file < 0 ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_SHARED, file,
                   static_cast<off_t>(offset_bytes))) {
  if (data_ == MAP_FAILED) throw std::bad_alloc();
}

MappedMemory::~MappedMemory() {
  if (data_ != nullptr) ::munmap(data_, size_bytes_);
}

MappedMemory::MappedMemory(MappedMemory&& other) noexcept
    : size_bytes_(other.size_bytes_), data_(std::exchange(other.data_, nullptr)) {}

MappedMemory& MappedMemory::operator=(MappedMemory&& other) noexcept {
  std::swap(size_bytes_, other.size_bytes_);
  std::swap(data_, other.data_);
  return *this;
}

void MappedMemory::prefer_large_pages() {
  // Where the system has none, small ones serve as well.
  static_cast<void>(::madvise(data_, size_bytes_, MADV_HUGEPAGE));
}

ScratchFile::ScratchFile(const std::string& folder) : folder_(folder) {
  std::string name = folder + "/loopbit_places_XXXXXX";
  descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) throw cannot_write(folder, errno);
  static_cast<void>(::unlink(name.c_str()));
}

ScratchFile::~ScratchFile() { ::close(descriptor_); }

MappedMemory ScratchFile::extend(std::size_t size_bytes) {
  const int failure = ::posix_fallocate(descriptor_, static_cast<off_t>(size_bytes_),
                                        static_cast<off_t>(size_bytes));
  if (failure != 0) throw cannot_write(folder_, failure);
  MappedMemory memory(size_bytes, descriptor_, size_bytes_);
  // Places that look alike lie anywhere: what is read next to one is seldom wanted.
  static_cast<void>(::madvise(memory.data(), size_bytes, MADV_RANDOM));
  size_bytes_ += size_bytes;
  return memory;
}

}  // namespace loopbit
