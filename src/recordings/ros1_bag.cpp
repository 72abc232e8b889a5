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

#include "compression.hpp"
#include "record_file.hpp"
#include "recording_file.hpp"

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
std::optional<Contents> read_index(Bytes index) {
  Connections channels;
  std::map<std::uint32_t, std::uint64_t> counts;
  Contents contents;
  ByteReader reader(index);
  while (reader.ok() && reader.left() > 0) {
    const Fields header(reader.counted_bytes());
    const Bytes data = reader.counted_bytes();
    if (header.op() == Op::connection) add_connection(header, data, channels);
    if (header.op() != Op::chunk_info) continue;
    contents.add_times(header.time_ns("start_time"), header.time_ns("end_time"));
    ByteReader pairs(data);
    while (pairs.left() >= 2 * sizeof(std::uint32_t)) {
      const auto connection = pairs.number<std::uint32_t>();
      counts[connection] += pairs.number<std::uint32_t>();
    }
  }
  if (!reader.ok() || channels.empty()) return std::nullopt;
  for (const auto& [id, channel] : channels) contents.channels.push_back({channel, counts[id]});
  return contents;
}

class Ros1Bag final : public RecordingFile {
 public:
  Ros1Bag(const std::filesystem::path& path, std::string topic)
      : file_(path), topic_(std::move(topic)) {
    check_version(path);
    const Bytes head = file_.read(at_, kMaxHeaderBytes);
    const Fields header(ByteReader(head).counted_bytes());
    index_at_ = header.op() == Op::bag_header ? header.number<std::uint64_t>("index_pos") : 0;
    if (header.text("encryptor").empty()) return;
    throw Error(
        ErrorKind::input,
        fmt::format("Bag '{}' is encrypted: decrypt it with 'rosbag decrypt'.", path.string()));
  }

  std::optional<Contents> contents() override {
    const std::uint64_t bytes = index_at_ == 0 ? 0 : file_.left(index_at_);
    if (bytes == 0 || bytes > kMaxIndexBytes) return std::nullopt;
    return read_index(file_.read(index_at_, static_cast<std::size_t>(bytes)));
  }

  bool next(Message& message) override {
    while (true) {
      if (next_in_chunk(message)) return true;
      if (ended_) return false;
      if (read_record(message)) return true;
    }
  }

  [[nodiscard]] std::string damage() const override {
    const bool has_no_index = index_at_ == 0 || file_.left(index_at_) == 0;
    return cut_off_ || has_no_index ? cut_off_after(file_.size()) : damaged_chunks(bad_chunks_);
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

  bool next_in_chunk(Message& message) {
    while (chunk_.ok() && chunk_.left() > 0) {
      const Fields header(chunk_.counted_bytes());
      const Bytes data = chunk_.counted_bytes();
      if (chunk_.ok() && take(header, data, message)) return true;
    }
    return false;
  }

  /// Reads a record outside of chunks. True if it is a message that is asked for. A recorder that
  /// was killed leaves those of its last chunk there.
  bool read_record(Message& message) {
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
    if (header.op() == Op::chunk) return read_chunk(header, begin, size), false;
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

  /// What a bag that is cut off has of its last chunk is read, too.
  void read_chunk(const Fields& header, std::uint64_t begin, std::uint64_t size) {
    const std::uint64_t there = std::min(size, file_.left(begin));
    const bool is_cut = there < size;
    cut_off_ = cut_off_ || is_cut;
    ended_ = ended_ || is_cut;
    const auto compression = compression_of(header.text("compression"));
    const auto unpacked = header.number<std::uint32_t>("size");
    records_.clear();
    bool is_good = compression && there <= kMaxChunkBytes && unpacked <= kMaxChunkBytes;
    if (is_good) {
      const Bytes stored = file_.read(begin, static_cast<std::size_t>(there));
      is_good = decompress(*compression, stored, unpacked, records_);
    }
    if (!is_good && !is_cut) {
      records_.clear();
      ++bad_chunks_;
    }
    chunk_ = ByteReader(records_);
  }

  /// True if the record is a message that is asked for.
  bool take(const Fields& header, Bytes data, Message& message) {
    if (header.op() == Op::connection) add_connection(header, data, channels_);
    if (header.op() != Op::message) return false;
    const auto channel = channels_.find(header.number<std::uint32_t>("conn"));
    if (channel == channels_.end()) return false;
    message = {&channel->second, header.time_ns("time"), data};
    return topic_.empty() || channel->second.topic == topic_;
  }

  RecordFile file_;
  std::string topic_;
  std::uint64_t at_ = kBagMagic.size();
  std::uint64_t index_at_ = 0;  ///< 0 in a bag that was not closed
  Connections channels_;
  std::vector<unsigned char> header_;   ///< of the record
  std::vector<unsigned char> records_;  ///< of the chunk
  ByteReader chunk_{Bytes()};           ///< what is left of them
  std::size_t bad_chunks_ = 0;
  bool ended_ = false;
  bool cut_off_ = false;
};

}  // namespace

std::unique_ptr<RecordingFile> open_ros1_bag(const std::filesystem::path& path, std::string topic) {
  return std::make_unique<Ros1Bag>(path, std::move(topic));
}

}  // namespace loopbit::recordings
