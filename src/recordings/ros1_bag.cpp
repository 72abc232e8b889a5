// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The bag format of ROS 1, version 2.0: https://wiki.ros.org/Bags/Format/2.0
//
// Debian's librosbag-storage is not used: it refuses a bag without an index, prints to stderr, and
// brings class_loader with plug-ins, Boost and GPG, 50 packages for this page of code.
#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "chunked_file.hpp"
#include "compression.hpp"

namespace loopbit::recordings {
namespace {

constexpr std::string_view kBagMagic = "#ROSBAG V2.0\n";
constexpr std::string_view kAnyBagMagic = "#ROSBAG V";
constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20U;

enum class Op : std::uint8_t {
  none = 0x00,
  message = 0x02,
  bag_header = 0x03,
  chunk = 0x05,
  chunk_info = 0x06,
  connection = 0x07,
};

/// "name=value" of a header, each after its length.
class Fields {
 public:
  explicit Fields(Bytes header) {
    ByteReader reader(header);
    while (reader.ok() && reader.left() > 0) {
      const Bytes field = reader.counted_bytes();
      const auto equals = std::ranges::find(field, '=');
      if (equals == field.end()) continue;
      fields_.insert_or_assign(std::string(field.begin(), equals), Bytes(equals + 1, field.end()));
    }
  }

  [[nodiscard]] Bytes bytes(const std::string& name) const {
    const auto found = fields_.find(name);
    return found == fields_.end() ? Bytes() : found->second;
  }

  [[nodiscard]] std::string text(const std::string& name) const {
    const Bytes characters = bytes(name);
    return {characters.begin(), characters.end()};
  }

  /// 0 if there is none.
  template <typename Number>
  [[nodiscard]] Number number(const std::string& name) const {
    return ByteReader(bytes(name)).number<Number>();
  }

  [[nodiscard]] Op op() const { return static_cast<Op>(number<std::uint8_t>("op")); }

  /// 0 if there is none.
  [[nodiscard]] std::uint64_t time_ns(const std::string& name) const {
    ByteReader reader(bytes(name));
    const std::uint64_t seconds = reader.number<std::uint32_t>();
    const std::uint64_t rest_ns = reader.number<std::uint32_t>();
    return seconds * kSecond_ns + rest_ns;
  }

 private:
  std::map<std::string, Bytes> fields_;
};

/// The connections that were read so far. They stay where they are.
using Connections = std::map<std::uint32_t, Channel>;

void add_connection(const Fields& header, Bytes data, Connections& channels) {
  channels.try_emplace(header.number<std::uint32_t>("conn"),
                       Channel{header.text("topic"), Fields(data).text("type"), Encoding::ros1});
}

/// Of what follows the last chunk. Nothing if it is damaged.
/// Adds its connections to `channels`, so that chunks are read whose connections stand in a damaged
/// one.
std::optional<Contents> read_index(Bytes index, Connections& channels) {
  std::map<std::uint32_t, std::uint64_t> counts;
  Contents contents;
  ByteReader reader(index);
  while (reader.ok() && reader.left() > 0) {
    const Fields header(reader.counted_bytes());
    const Bytes data = reader.counted_bytes();
    if (!reader.ok()) return std::nullopt;
    if (header.op() == Op::connection) add_connection(header, data, channels);
    if (header.op() != Op::chunk_info) continue;
    contents.add_times(header.time_ns("start_time"), header.time_ns("end_time"));
    ByteReader pairs(data);
    while (pairs.left() >= 2 * sizeof(std::uint32_t)) {
      const auto connection = pairs.number<std::uint32_t>();
      counts[connection] += pairs.number<std::uint32_t>();
    }
  }
  if (channels.empty()) return std::nullopt;
  for (const auto& [id, channel] : channels) contents.channels.push_back({channel, counts[id]});
  return contents;
}

class Ros1Bag final : public ChunkedFile {
 public:
  Ros1Bag(const std::filesystem::path& path, std::string topic)
      : ChunkedFile(path, std::move(topic), kBagMagic.size()) {
    check_version(path);
    const Bytes head = file_.read(at_, kMaxHeaderBytes);
    const Fields header(ByteReader(head).counted_bytes());
    const bool is_header = header.op() == Op::bag_header;
    const auto index_at = is_header ? header.number<std::uint64_t>("index_pos") : 0;
    if (!header.text("encryptor").empty()) {
      throw Error(
          ErrorKind::input,
          fmt::format("Bag '{}' is encrypted: decrypt it with 'rosbag decrypt'.", path.string()));
    }
    const std::uint64_t index_bytes = file_.left(index_at);
    cut_off_ = index_at == 0 || index_bytes == 0;
    if (cut_off_ || index_bytes > kMaxIndexBytes) return;
    index_ = read_index(file_.read(index_at, static_cast<std::size_t>(index_bytes)), channels_);
  }

 private:
  void check_version(const std::filesystem::path& path) {
    const Bytes magic = file_.read(0, kBagMagic.size());
    const std::string_view text(reinterpret_cast<const char*>(magic.data()), magic.size());
    if (text == kBagMagic) return;
    const bool is_old = text.starts_with(kAnyBagMagic);
    throw Error(ErrorKind::input,
                fmt::format("'{}' is not a ROS 1 bag of version 2.0: {}.", path.string(),
                            is_old ? "convert it with 'rosbag fix'" : "copy it again"));
  }

  bool next_in_chunk(Message& message) override {
    while (chunk_.ok() && chunk_.left() > 0) {
      const Fields header(chunk_.counted_bytes());
      const Bytes data = chunk_.counted_bytes();
      if (chunk_.ok() && take(header, data, message)) return true;
    }
    return false;
  }

  /// A recorder that was killed leaves the messages of its last chunk outside of chunks.
  bool read_record(Message& message) override {
    if (file_.left(at_) == 0) {
      ended_ = true;
      return false;
    }
    const auto header_bytes = read_size();
    const Bytes header_view = file_.read(at_, std::min<std::size_t>(header_bytes, kMaxHeaderBytes));
    const bool has_header = header_view.size() == header_bytes;
    header_.assign(header_view.begin(), header_view.end());
    const Fields header(header_);
    at_ += header_bytes;
    const std::uint64_t size = read_size();
    const std::uint64_t there = std::min(size, file_.left(at_));
    const std::uint64_t begin = at_;
    at_ += there;
    if (!has_header || ended_ || header.op() == Op::none ||
        (there < size && header.op() != Op::chunk)) {
      cut_off_ = ended_ = true;
      return false;
    }
    if (header.op() == Op::chunk) {
      begin_chunk(begin, size,
                  [&](Bytes content, bool is_cut) { return unpack(header, content, is_cut); });
    }
    const bool is_read = header.op() == Op::message || header.op() == Op::connection;
    if (!is_read || size > kMaxMessageBytes) return false;
    return take(header, file_.read(begin, static_cast<std::size_t>(size)), message);
  }

  /// The length before a header or data. Ends where there is none.
  std::uint32_t read_size() {
    ByteReader reader(file_.read(at_, sizeof(std::uint32_t)));
    const auto size = reader.number<std::uint32_t>();
    at_ += sizeof(std::uint32_t);
    if (!reader.ok()) ended_ = true;
    return size;
  }

  bool unpack(const Fields& header, Bytes content, bool is_cut) {
    const auto compression = compression_of(header.text("compression"));
    const auto size = header.number<std::uint32_t>("size");
    if (!compression || size > kMaxChunkBytes) return false;
    return decompress(*compression, content, size, records_) || is_cut;
  }

  /// True if the record is a message that is asked for.
  bool take(const Fields& header, Bytes data, Message& message) {
    if (header.op() == Op::connection) add_connection(header, data, channels_);
    if (header.op() != Op::message) return false;
    const auto channel = channels_.find(header.number<std::uint32_t>("conn"));
    if (channel == channels_.end()) return false;
    message = {&channel->second, header.time_ns("time"), data};
    return is_wanted(channel->second);
  }

  Connections channels_;
  std::vector<unsigned char> header_;  ///< of the record
};

}  // namespace

std::unique_ptr<RecordingFile> open_ros1_bag(const std::filesystem::path& path, std::string topic) {
  return std::make_unique<Ros1Bag>(path, std::move(topic));
}

}  // namespace loopbit::recordings
