// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/database.hpp"
#include "loopbit/map_database.hpp"

namespace loopbit {

/// A map in a SQLite file.
class FileDatabase final : public MapDatabase {
 public:
  explicit FileDatabase(Database file) : file_(std::move(file)) {}

  [[nodiscard]] const Database& file() const { return file_; }

  [[nodiscard]] const std::string& path() const override { return file_.path(); }
  [[nodiscard]] int version() const override;
  [[nodiscard]] std::unique_ptr<SqlStatement> prepare(const std::string& sql) const override;
  [[nodiscard]] std::int64_t rows_at_once() const override;
  [[nodiscard]] std::unique_ptr<Transaction> snapshot() const override;
  [[nodiscard]] std::unique_ptr<Transaction> begin() const override;
  void prepare_long_transaction() const override;
  [[nodiscard]] NewSession begin_session() const override;
  [[nodiscard]] std::vector<int> new_sessions(std::size_t number) const override;
  [[nodiscard]] bool hold_session(int session) const override;
  [[nodiscard]] std::int64_t place_key(const SessionFrame& at,
                                       std::int64_t previous) const override;
  [[nodiscard]] bool is_being_written() const override { return file_.file().is_locked(); }
  [[nodiscard]] std::int64_t bytes() const override;
  [[nodiscard]] std::string fault() const override;
  [[nodiscard]] std::vector<std::string> structure_faults() const override;
  [[nodiscard]] bool has_search() const override { return false; }
  [[nodiscard]] bool is_lost() const override { return false; }
  void reconnect() override {}
  void set_time_limit(std::chrono::milliseconds /*limit*/) override {}
  void interrupt() override {}
  [[nodiscard]] std::int64_t epoch() const override { return 0; }
  void wait_for_commit(std::chrono::milliseconds /*most*/) override {}
  void hold_back_commits() const override {}  // there is one writer
  void close() override;

 private:
  Database file_;
};

/// Opens a map in a file, or on a server. Throws Error as open_map_for_reading() or
/// open_map_for_writing() do, or MapServer::open().
std::unique_ptr<MapDatabase> open_map(const std::string& path, MapDatabase::Access access);

}  // namespace loopbit
