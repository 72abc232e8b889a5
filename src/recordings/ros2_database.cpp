// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The SQLite files of rosbag2: tables topics and messages.
#include <algorithm>
#include <bit>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include "loopbit/database.hpp"

#include "recording_file.hpp"

namespace loopbit::recordings {
namespace {

constexpr const char* kDatabaseRemedy =
    "copy it again; where it is damaged, 'sqlite3 FILE .recover' may save the rest";

using DatabaseTopics = std::map<std::int64_t, Channel>;

DatabaseTopics read_topics(const Database& database) {
  DatabaseTopics topics;
  Statement rows(database, "SELECT id, name, type, serialization_format FROM topics");
  while (rows.step_if_readable() == Statement::Step::row) {
    if (rows.text(1).empty()) continue;  // of a page that was cut in two
    const Encoding encoding = rows.text(3) == "cdr" ? Encoding::cdr : Encoding::other;
    topics.try_emplace(rows.integer(0), Channel{rows.text(1), rows.text(2), encoding});
  }
  return topics;
}

/// Whether the file is shorter than its header says. SQLite fills up a page that is cut in two with
/// zeros. A writer that keeps no count of pages leaves the two numbers different.
bool is_cut_off(const Database& database) {
  const auto header = database.header();
  const auto number = [&](std::size_t at) {
    return ByteReader(Bytes(header).subspan(at), std::endian::big).number<std::uint32_t>();
  };
  constexpr std::size_t kChanges = 24;
  constexpr std::size_t kPages = 28;
  constexpr std::size_t kChangesAtCount = 92;
  const auto page_bytes = static_cast<std::uint64_t>(database.integer("PRAGMA page_size"));
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(database.path(), error);
  return !error && number(kChanges) == number(kChangesAtCount) &&
         bytes < number(kPages) * page_bytes;
}

class Ros2Database final : public RecordingFile {
 public:
  Ros2Database(const std::filesystem::path& path, std::string topic)
      : database_(path.string(), Database::Access::read, {kDatabaseRemedy, kDatabaseRemedy}),
        topic_(std::move(topic)),
        topics_(read_topics(database_)),
        messages_(database_, "SELECT topic_id, timestamp, data FROM messages ORDER BY id"),
        damaged_(is_cut_off(database_)) {}

  std::optional<Contents> contents() override {
    Contents contents;
    std::map<std::int64_t, std::uint64_t> counts;
    // Row by row, so that those before a damage count. Images are not read for it.
    Statement rows(database_, "SELECT topic_id, timestamp FROM messages ORDER BY id");
    while (rows.step_if_readable() == Statement::Step::row) {
      const auto time_ns = static_cast<std::uint64_t>(rows.integer(1));
      ++counts[rows.integer(0)];
      contents.add_times(time_ns, time_ns);
    }
    for (const auto& [id, channel] : topics_) contents.channels.push_back({channel, counts[id]});
    return contents;
  }

  bool next(Message& message) override {
    if (!damaged_) return read_next(message);
    // The last message may end in the page that was cut in two.
    if (!has_held_ && !hold_next()) return false;
    held_.swap(given_);
    message = held_message_;
    message.data = given_;
    return hold_next();
  }

  [[nodiscard]] std::string damage() const override {
    return damaged_ ? "is damaged or cut off, and its last messages are missing" : "";
  }

 private:
  bool read_next(Message& message) {
    while (step()) {
      const auto channel = topics_.find(messages_.integer(0));
      if (channel == topics_.end()) continue;
      if (!topic_.empty() && channel->second.topic != topic_) continue;
      message = {&channel->second, static_cast<std::uint64_t>(messages_.integer(1)),
                 messages_.bytes(2)};
      return true;
    }
    return false;
  }

  /// Reads a message ahead. False at the end.
  bool hold_next() {
    has_held_ = read_next(held_message_);
    if (has_held_) held_.assign(held_message_.data.begin(), held_message_.data.end());
    return has_held_;
  }

  bool step() {
    if (ended_) return false;  // SQLite would begin again
    const Statement::Step step = messages_.step_if_readable();
    damaged_ = damaged_ || step == Statement::Step::damaged;
    ended_ = step != Statement::Step::row;
    return !ended_;
  }

  Database database_;
  std::string topic_;
  DatabaseTopics topics_;
  Statement messages_;
  bool ended_ = false;
  bool damaged_;
  Message held_message_;  ///< read ahead of a damaged file
  bool has_held_ = false;
  std::vector<unsigned char> held_;
  std::vector<unsigned char> given_;
};

}  // namespace

std::unique_ptr<RecordingFile> open_ros2_database(const std::filesystem::path& path,
                                                  std::string topic) {
  return std::make_unique<Ros2Database>(path, std::move(topic));
}

}  // namespace loopbit::recordings
