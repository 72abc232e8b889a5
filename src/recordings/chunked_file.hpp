// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "record_file.hpp"
#include "recording_file.hpp"

namespace loopbit::recordings {

/// What MCAP files and ROS 1 bags have in common: records one after another, most of them in
/// chunks, and an index at the end.
class ChunkedFile : public RecordingFile {
 public:
  std::optional<Contents> contents() override { return index_; }

  bool next(Message& message) override {
    while (true) {
      if (next_in_chunk(message)) return true;
      if (ended_) return false;
      if (read_record(message)) return true;
    }
  }

  [[nodiscard]] std::string damage() const override {
    return cut_off_ ? cut_off_after(file_.size()) : damaged_chunks(bad_chunks_);
  }

 protected:
  /// `at`: the first record.
  ChunkedFile(const std::filesystem::path& path, std::string topic, std::uint64_t at)
      : file_(path), at_(at), topic_(std::move(topic)) {}

  /// The next message of the chunk. False at its end.
  virtual bool next_in_chunk(Message& message) = 0;

  /// Reads the next record of the file. True if it is a message that is asked for.
  virtual bool read_record(Message& message) = 0;

  /// Goes on in the chunk whose content stands in the file at `begin`. `unpack(content, is_cut)`
  /// fills records_, and returns false if they are damaged. What a file that is cut off has of its
  /// last chunk is read, too.
  template <typename Unpack>
  void begin_chunk(std::uint64_t begin, std::uint64_t size, const Unpack& unpack) {
    const std::uint64_t there = std::min(size, file_.left(begin));
    const bool is_cut = there < size;
    if (is_cut) cut_off_ = ended_ = true;
    records_.clear();
    const bool is_good = there <= kMaxChunkBytes &&
                         unpack(file_.read(begin, static_cast<std::size_t>(there)), is_cut);
    if (!is_good) records_.clear();
    if (!is_good && !is_cut) ++bad_chunks_;
    chunk_ = ByteReader(records_);
  }

  [[nodiscard]] bool is_wanted(const Channel& channel) const {
    return topic_.empty() || channel.topic == topic_;
  }

  RecordFile file_;
  std::uint64_t at_;                    ///< the next record of the file
  std::optional<Contents> index_;       ///< what the index says, if there is one
  std::vector<unsigned char> records_;  ///< of the chunk
  ByteReader chunk_{Bytes()};           ///< what is left of them
  bool ended_ = false;
  bool cut_off_ = false;

 private:
  std::string topic_;
  std::size_t bad_chunks_ = 0;
};

}  // namespace loopbit::recordings
