// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/mcap_writer.hpp"

#include <cerrno>
#include <concepts>
#include <cstdio>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include "loopbit/version.hpp"
#include "loopbit/write_file.hpp"

#include "compression.hpp"
#include "mcap_format.hpp"

namespace loopbit::recordings {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChunkBytes = 1U << 20U;

/// Little-endian numbers and counted texts, one after another.
class ByteWriter {
 public:
  template <std::unsigned_integral Number>
  ByteWriter& number(Number value) {
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      bytes_.push_back(static_cast<unsigned char>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
    return *this;
  }
  ByteWriter& bytes(Bytes bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  ByteWriter& characters(std::string_view text) {
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    return *this;
  }
  /// After its length, which is 4 bytes long.
  ByteWriter& text(std::string_view text) {
    return number(static_cast<std::uint32_t>(text.size())).characters(text);
  }
  /// An array or a map, after its length in bytes.
  ByteWriter& counted(const ByteWriter& content) {
    return number(static_cast<std::uint32_t>(content.size())).bytes(content.all());
  }
  ByteWriter& record(Opcode opcode, const ByteWriter& content) {
    number(static_cast<std::uint8_t>(opcode)).number(std::uint64_t{content.size()});
    return bytes(content.all());
  }
  void clear() { bytes_.clear(); }
  [[nodiscard]] Bytes all() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

 private:
  std::vector<unsigned char> bytes_;
};

}  // namespace

class McapWriter::Impl {
 public:
  explicit Impl(const std::string& path)
      : path_(path), target_(resolved_path(path)), part_(target_) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    is_device_ = fs::exists(status) && !fs::is_regular_file(status);
    if (!is_device_) part_ += ".part";
    file_.reset(std::fopen(part_.c_str(), "wb"));
    if (!file_) throw cannot_write(path_, errno);
    write(kMcapMagic);
    ByteWriter header;
    header.record(Opcode::header, ByteWriter().text("").text(std::string("loopbit ") + kVersion));
    write(header.all());
  }

  ~Impl() {
    if (is_finished_ || is_device_) return;
    file_.reset();
    std::error_code error;
    fs::remove(part_, error);
  }

  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  std::uint16_t add_topic(const std::string& topic, const std::string& schema_name,
                          std::string_view json_schema) {
    const auto id = static_cast<std::uint16_t>(counts_.size() + 1);
    schemas_.record(Opcode::schema,
                    ByteWriter().number(id).text(schema_name).text("jsonschema").text(json_schema));
    channels_.record(
        Opcode::channel,
        ByteWriter().number(id).number(id).text(topic).text("json").counted(ByteWriter()));
    counts_[id] = 0;
    return id;
  }

  void add(std::uint16_t topic, std::uint64_t time_ns, std::string_view json) {
    if (messages_++ == 0) {
      write(schemas_.all());
      write(channels_.all());
      first_ns_ = time_ns;
    }
    if (chunk_.size() == 0) chunk_first_ns_ = time_ns;
    last_ns_ = time_ns;
    index_[topic].number(time_ns).number(std::uint64_t{chunk_.size()});
    const auto sequence = static_cast<std::uint32_t>(counts_[topic]++);
    ByteWriter message;
    message.number(topic).number(sequence).number(time_ns).number(time_ns).characters(json);
    chunk_.record(Opcode::message, message);
    if (chunk_.size() >= kChunkBytes) write_chunk();
  }

  void finish() {
    if (messages_ == 0) {
      write(schemas_.all());
      write(channels_.all());
    }
    if (chunk_.size() > 0) write_chunk();
    ByteWriter end;
    end.record(Opcode::data_end, ByteWriter().number(std::uint32_t{0}));
    write(end.all());
    write_summary();
    write(kMcapMagic);
    if (std::fclose(file_.release()) != 0) throw cannot_write(path_, errno);
    std::error_code error;
    if (!is_device_) fs::rename(part_, target_, error);
    if (error) throw cannot_write(path_, error.value());
    is_finished_ = true;
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { (void)std::fclose(file); }
  };

  void write(Bytes bytes) {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
      throw cannot_write(path_, errno);
    }
    at_ += bytes.size();
  }

  /// The chunk, an index of its messages for each topic, and the entry of both in the summary.
  void write_chunk() {
    const std::vector<unsigned char> packed = compress_zstd(chunk_.all());
    ByteWriter chunk;
    chunk.record(Opcode::chunk, ByteWriter()
                                    .number(chunk_first_ns_)
                                    .number(last_ns_)
                                    .number(std::uint64_t{chunk_.size()})
                                    .number(checksum(chunk_.all()))
                                    .text("zstd")
                                    .number(std::uint64_t{packed.size()})
                                    .bytes(packed));
    const std::uint64_t chunk_at = at_;
    write(chunk.all());
    const std::uint64_t index_at = at_;
    ByteWriter offsets;
    for (const auto& [topic, times] : index_) {
      offsets.number(topic).number(at_);
      ByteWriter index;
      index.record(Opcode::message_index, ByteWriter().number(topic).counted(times));
      write(index.all());
    }
    chunks_.record(Opcode::chunk_index, ByteWriter()
                                            .number(chunk_first_ns_)
                                            .number(last_ns_)
                                            .number(chunk_at)
                                            .number(std::uint64_t{chunk.size()})
                                            .counted(offsets)
                                            .number(at_ - index_at)
                                            .text("zstd")
                                            .number(std::uint64_t{packed.size()})
                                            .number(std::uint64_t{chunk_.size()}));
    ++chunk_count_;
    chunk_.clear();
    index_.clear();
  }

  void write_summary() {
    const std::uint64_t summary_at = at_;
    ByteWriter counts;
    for (const auto& [topic, count] : counts_) counts.number(topic).number(count);
    ByteWriter statistics;
    statistics.record(Opcode::statistics, ByteWriter()
                                              .number(messages_)
                                              .number(static_cast<std::uint16_t>(counts_.size()))
                                              .number(static_cast<std::uint32_t>(counts_.size()))
                                              .number(std::uint32_t{0})  // attachments
                                              .number(std::uint32_t{0})  // metadata
                                              .number(chunk_count_)
                                              .number(first_ns_)
                                              .number(last_ns_)
                                              .counted(counts));
    ByteWriter offsets;
    for (const auto& [opcode, group] : {std::pair(Opcode::schema, &schemas_),
                                        {Opcode::channel, &channels_},
                                        {Opcode::statistics, &statistics},
                                        {Opcode::chunk_index, &chunks_}}) {
      if (group->size() == 0) continue;
      offsets.record(Opcode::summary_offset, ByteWriter()
                                                 .number(static_cast<std::uint8_t>(opcode))
                                                 .number(at_)
                                                 .number(std::uint64_t{group->size()}));
      write(group->all());
    }
    ByteWriter footer;
    footer.record(Opcode::footer,
                  ByteWriter().number(summary_at).number(at_).number(std::uint32_t{0}));
    write(offsets.all());
    write(footer.all());
  }

  std::string path_;
  fs::path target_;
  fs::path part_;           ///< what is written
  bool is_device_ = false;  ///< or a pipe: written directly
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t at_ = 0;
  ByteWriter schemas_;
  ByteWriter channels_;
  ByteWriter chunks_;  ///< their index
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t messages_ = 0;
  std::uint64_t first_ns_ = 0;
  std::uint64_t last_ns_ = 0;
  std::uint32_t chunk_count_ = 0;
  ByteWriter chunk_;  ///< that is being filled
  std::uint64_t chunk_first_ns_ = 0;
  std::map<std::uint16_t, ByteWriter> index_;  ///< of that chunk: time and place of each message
  bool is_finished_ = false;
};

McapWriter::McapWriter(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
McapWriter::~McapWriter() = default;

std::uint16_t McapWriter::add_topic(const std::string& topic, const std::string& schema_name,
                                    std::string_view json_schema) {
  return impl_->add_topic(topic, schema_name, json_schema);
}

void McapWriter::add(std::uint16_t topic, std::uint64_t time_ns, std::string_view json) {
  impl_->add(topic, time_ns, json);
}

void McapWriter::finish() { impl_->finish(); }

}  // namespace loopbit::recordings
