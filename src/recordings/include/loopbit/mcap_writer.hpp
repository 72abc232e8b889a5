// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace loopbit::recordings {

/// Writes an MCAP file of messages in JSON: chunks compressed by zstd, with an index. The file gets
/// its name when it is whole; an earlier one is kept until then, and if something fails. Devices
/// and pipes are written directly. The functions throw Error (kind output) if the disk refuses.
class McapWriter {
 public:
  explicit McapWriter(const std::string& path);
  /// Removes what was written, unless finish() was called.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  McapWriter(McapWriter&&) = delete;
  McapWriter& operator=(McapWriter&&) = delete;

  /// A topic whose messages have a JSON schema. Returns its number for add(). All topics come
  /// before the first message.
  std::uint16_t add_topic(const std::string& topic, const std::string& schema_name,
                          std::string_view json_schema);

  /// Messages come in the order of time.
  void add(std::uint16_t topic, std::uint64_t time_ns, std::string_view json);

  void finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit::recordings
