// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/map_database.hpp"

#include "connection.hpp"

namespace loopbit {

/// A map on a PostgreSQL server. Any number of programs may add sessions at once.
class FleetDatabase final : public MapDatabase {
 public:
  /// Throws Error as MapServer::open() does.
  FleetDatabase(const Address& address, Access access);

  [[nodiscard]] const std::string& path() const override { return connection_.shown(); }
  [[nodiscard]] int version() const override;
  [[nodiscard]] std::unique_ptr<SqlStatement> prepare(const std::string& sql) const override;
  [[nodiscard]] std::int64_t rows_at_once() const override;
  [[nodiscard]] std::unique_ptr<Transaction> begin() const override;
  [[nodiscard]] std::unique_ptr<Transaction> snapshot() const override;
  void prepare_long_transaction() const override {}
  [[nodiscard]] std::vector<int> new_sessions(std::size_t number) const override;
  [[nodiscard]] NewSession begin_session() const override;
  [[nodiscard]] bool hold_session(int session) const override;
  [[nodiscard]] std::int64_t place_key(const SessionFrame& at,
                                       std::int64_t previous) const override;
  [[nodiscard]] bool is_being_written() const override;
  [[nodiscard]] std::int64_t bytes() const override;
  [[nodiscard]] std::string fault() const override { return {}; }
  [[nodiscard]] std::vector<std::string> structure_faults() const override { return {}; }
  [[nodiscard]] bool has_search() const override;
  [[nodiscard]] bool is_lost() const override { return connection_.is_lost(); }
  void reconnect() override;
  void set_time_limit(std::chrono::milliseconds limit) override {
    connection_.set_time_limit(limit);
  }
  void interrupt() override { connection_.interrupt(); }
  [[nodiscard]] std::int64_t epoch() const override;
  void wait_for_commit(std::chrono::milliseconds most) override;
  void hold_back_commits() const override;
  void close() override {}

 private:
  class OpenTransaction;

  Connection connection_;
  mutable bool in_transaction_ = false;
  mutable int session_ = 0;  ///< that is being written; 0 = none
};

}  // namespace loopbit
