// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "byte_reader.hpp"

namespace loopbit::recordings {

/// How the bytes of a message are laid out.
enum class Encoding : std::uint8_t {
  cdr,    ///< of ROS 2
  ros1,   ///< of ROS 1
  other,  ///< not read here
};

/// What was published under one name, by one publisher.
struct Channel {
  std::string topic;
  std::string type;  ///< such as "sensor_msgs/msg/Image"
  Encoding encoding = Encoding::other;
};

struct Message {
  const Channel* channel = nullptr;  ///< valid as long as the file
  std::uint64_t time_ns = 0;         ///< of its recording, since 1970
  Bytes data;                        ///< valid until the next message is read
};

/// How many messages a channel has.
struct ChannelCount {
  Channel channel;
  std::uint64_t messages = 0;
};

/// What a file holds.
struct Contents {
  std::vector<ChannelCount> channels;
  std::uint64_t first_ns = ~std::uint64_t{0};  ///< of messages, which may be in any order
  std::uint64_t last_ns = 0;

  /// Extends the time by that of a message or of several.
  void add_times(std::uint64_t first, std::uint64_t last) {
    first_ns = std::min(first_ns, first);
    last_ns = std::max(last_ns, last);
  }
};

/// One file of a recording. Messages come in the order in which they are stored. A file is never
/// trusted: a damaged or hostile one gives fewer messages or wrong ones, and takes at most
/// kMaxChunkBytes of memory for a chunk and kMaxMessageBytes for a message. Functions throw Error
/// (kind input) where the system cannot read.
class RecordingFile {
 public:
  virtual ~RecordingFile() = default;

  /// What an index says, so that the file need not be read. Nothing if there is none.
  virtual std::optional<Contents> contents() = 0;

  /// Reads the next message of the topic that the file was opened for. False at the end.
  virtual bool next(Message& message) = 0;

  /// When next() returned false: what the file lacks, as the end of a sentence that begins with its
  /// name; empty if it is whole.
  [[nodiscard]] virtual std::string damage() const = 0;
};

inline constexpr std::uint64_t kSecond_ns = 1'000'000'000;

/// Larger ones are not read.
inline constexpr std::uint64_t kMaxIndexBytes = std::uint64_t{256} << 20U;
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 30U;
inline constexpr std::uint64_t kMaxMessageBytes = std::uint64_t{256} << 20U;

/// Each opens a file for the messages of `topic`, or of all topics if that is empty. Throws Error
/// (kind input) if the file cannot be read or is of another format.
std::unique_ptr<RecordingFile> open_mcap(const std::filesystem::path& path, std::string topic);
std::unique_ptr<RecordingFile> open_ros1_bag(const std::filesystem::path& path, std::string topic);
std::unique_ptr<RecordingFile> open_ros2_database(const std::filesystem::path& path,
                                                  std::string topic);

/// "is cut off after N bytes, and its last messages are missing".
std::string cut_off_after(std::uint64_t bytes);

/// "has N damaged chunks, and their messages are missing"; empty for 0.
std::string damaged_chunks(std::size_t count);

}  // namespace loopbit::recordings
