// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "chunked_file.hpp"
#include "compression.hpp"
#include "mcap_format.hpp"

namespace loopbit::recordings {
namespace {

constexpr std::uint64_t kHeadBytes = 9;     ///< opcode and length of a record
constexpr std::uint64_t kFooterBytes = 20;  ///< content of that record

struct Head {
  Opcode opcode;
  std::uint64_t size;
};

Head read_head(ByteReader& reader) {
  const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
  return {opcode, reader.number<std::uint64_t>()};
}

Encoding encoding_of(const std::string& name) {
  if (name == "cdr") return Encoding::cdr;
  if (name == "ros1") return Encoding::ros1;
  return Encoding::other;
}

/// The schemas and channels that were read so far. McapChannels stay where they are.
class McapChannels {
 public:
  /// Of a record of these kinds.
  void add(Opcode opcode, Bytes content) {
    ByteReader reader(content);
    const auto id = reader.number<std::uint16_t>();
    if (opcode == Opcode::schema) {
      const std::string type = reader.text();
      if (reader.ok()) types_.try_emplace(id, type);
      return;
    }
    const auto type = types_.find(reader.number<std::uint16_t>());
    Channel channel{.topic = reader.text(), .type = type == types_.end() ? "" : type->second};
    channel.encoding = encoding_of(reader.text());
    if (reader.ok()) channels_.try_emplace(id, std::move(channel));
  }

  /// Null if there is none.
  [[nodiscard]] const Channel* find(std::uint16_t id) const {
    const auto found = channels_.find(id);
    return found == channels_.end() ? nullptr : &found->second;
  }

  [[nodiscard]] const std::map<std::uint16_t, Channel>& all() const { return channels_; }

 private:
  std::map<std::uint16_t, std::string> types_;
  std::map<std::uint16_t, Channel> channels_;
};

/// Adds what a statistics record counts. False if it does not count the messages of each channel.
bool add_counts(Bytes statistics, const McapChannels& channels, Contents& contents) {
  ByteReader reader(statistics);
  const auto messages = reader.number<std::uint64_t>();
  reader.bytes(sizeof(std::uint16_t) + 4 * sizeof(std::uint32_t));  // counts of other records
  const auto first_ns = reader.number<std::uint64_t>();
  contents.add_times(first_ns, reader.number<std::uint64_t>());
  std::map<std::uint16_t, std::uint64_t> counts;
  std::uint64_t counted = 0;
  ByteReader pairs(reader.counted_bytes());
  while (reader.ok() && pairs.ok() && pairs.left() > 0) {
    const auto id = pairs.number<std::uint16_t>();
    const auto count = pairs.number<std::uint64_t>();
    counts[id] += count;
    counted += count;
  }
  if (!reader.ok() || !pairs.ok() || counted != messages) return false;
  for (const auto& [id, channel] : channels.all())
    contents.channels.push_back({channel, counts[id]});
  return true;
}

/// Of a summary section. Nothing if it does not count the messages of each channel.
/// Adds its channels to `channels`, so that chunks are read whose channels stand in a damaged one.
std::optional<Contents> read_summary(Bytes summary, McapChannels& channels) {
  Bytes statistics;
  ByteReader reader(summary);
  while (reader.ok() && reader.left() >= kHeadBytes) {
    const Head head = read_head(reader);
    const Bytes content = reader.bytes(head.size);
    if (head.opcode == Opcode::schema || head.opcode == Opcode::channel) {
      channels.add(head.opcode, content);
    }
    if (head.opcode == Opcode::statistics) statistics = content;
  }
  Contents contents;
  if (!reader.ok() || !add_counts(statistics, channels, contents)) return std::nullopt;
  return contents;
}

class McapFile final : public ChunkedFile {
 public:
  McapFile(const std::filesystem::path& path, std::string topic)
      : ChunkedFile(path, std::move(topic), kMcapMagic.size()) {
    if (!std::ranges::equal(file_.read(0, kMcapMagic.size()), kMcapMagic)) {
      throw Error(
          ErrorKind::input,
          fmt::format("'{}' is not an MCAP file of version 0: copy it again, or convert it.",
                      path.string()));
    }
    const Bytes summary = find_summary();
    if (!summary.empty()) index_ = read_summary(summary, channels_);
  }

 private:
  /// Empty if there is none.
  Bytes find_summary() {
    constexpr std::uint64_t kEndBytes = kHeadBytes + kFooterBytes + kMcapMagic.size();
    if (file_.size() < kEndBytes + kMcapMagic.size()) return {};
    const std::uint64_t footer_at = file_.size() - kEndBytes;
    const Bytes end = file_.read(footer_at, kEndBytes);
    ByteReader reader(end);
    const Head head = read_head(reader);
    const auto summary_at = reader.number<std::uint64_t>();
    const bool is_footer = head.opcode == Opcode::footer && head.size == kFooterBytes &&
                           std::ranges::equal(end.last(kMcapMagic.size()), kMcapMagic);
    if (!is_footer || summary_at == 0 || summary_at > footer_at) return {};
    if (footer_at - summary_at > kMaxIndexBytes) return {};
    return file_.read(summary_at, static_cast<std::size_t>(footer_at - summary_at));
  }

  bool next_in_chunk(Message& message) override {
    while (chunk_.ok() && chunk_.left() >= kHeadBytes) {
      const Head head = read_head(chunk_);
      const Bytes content = chunk_.bytes(head.size);
      if (chunk_.ok() && take(head.opcode, content, message)) return true;
    }
    return false;
  }

  bool read_record(Message& message) override {
    ByteReader reader(file_.read(at_, kHeadBytes));
    const Head head = read_head(reader);
    const std::uint64_t left = file_.left(at_ + kHeadBytes);
    if (!reader.ok() || (head.size > left && head.opcode != Opcode::chunk)) {
      cut_off_ = ended_ = true;
      return false;
    }
    at_ += kHeadBytes;
    const std::uint64_t begin = at_;
    at_ += std::min(head.size, left);
    if (head.opcode == Opcode::data_end || head.opcode == Opcode::footer) ended_ = true;
    if (head.opcode == Opcode::chunk) {
      begin_chunk(begin, head.size,
                  [&](Bytes content, bool is_cut) { return unpack(content, is_cut); });
    }
    if (!is_read(head.opcode) || head.size > kMaxMessageBytes) return false;
    return take(head.opcode, file_.read(begin, static_cast<std::size_t>(head.size)), message);
  }

  static bool is_read(Opcode opcode) {
    return opcode == Opcode::schema || opcode == Opcode::channel || opcode == Opcode::message;
  }

  /// Fills records_. False if they are damaged, or there is none.
  bool unpack(Bytes content, bool is_cut) {
    ByteReader reader(content);
    reader.bytes(2 * sizeof(std::uint64_t));  // times
    const auto size = reader.number<std::uint64_t>();
    const auto expected_checksum = reader.number<std::uint32_t>();
    const auto compression = compression_of(reader.text());
    const auto stored = reader.number<std::uint64_t>();
    if (!reader.ok() || !compression || size > kMaxChunkBytes) return false;
    const Bytes records =
        reader.bytes(is_cut ? std::min<std::uint64_t>(stored, reader.left()) : stored);
    if (!reader.ok()) return false;
    const bool is_whole =
        decompress(*compression, records, static_cast<std::size_t>(size), records_);
    if (is_cut) return true;
    return is_whole && (expected_checksum == 0 || checksum(records_) == expected_checksum);
  }

  /// True if the record is a message that is asked for.
  bool take(Opcode opcode, Bytes content, Message& message) {
    if (opcode == Opcode::schema || opcode == Opcode::channel) channels_.add(opcode, content);
    if (opcode != Opcode::message) return false;
    ByteReader reader(content);
    message.channel = channels_.find(reader.number<std::uint16_t>());
    reader.number<std::uint32_t>();  // its number
    message.time_ns = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // when it was published, by the publisher's clock
    message.data = reader.bytes(reader.left());
    return reader.ok() && message.channel != nullptr && is_wanted(*message.channel);
  }

  McapChannels channels_;
};

}  // namespace

std::unique_ptr<RecordingFile> open_mcap(const std::filesystem::path& path, std::string topic) {
  return std::make_unique<McapFile>(path, std::move(topic));
}

}  // namespace loopbit::recordings
