// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <libpq-fe.h>

#include "loopbit/map_database.hpp"
#include "loopbit/sql_statement.hpp"

#include "address.hpp"

namespace loopbit {

struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};
using Result = std::unique_ptr<PGresult, ClearResult>;

/// The value of a parameter in PostgreSQL's binary format; none = NULL.
using Parameter = std::optional<std::string>;
Parameter parameter(std::int64_t value);

/// The number in a column of a row; 0 if it has none.
std::int64_t integer_in(const PGresult& result, int row, int column);

/// A connection to a PostgreSQL server. Every failure is an Error that names the server and a
/// remedy. Values from outside are only sent as parameters, never as part of a statement.
class Connection {
 public:
  Connection(const Address& address, MapDatabase::Access access);

  /// Runs statements. The result is that of the last one.
  Result execute(const std::string& sql) const;

  /// Runs a statement with parameters $1, $2 and so on, which is prepared on its first use.
  Result run(const std::string& sql, const std::vector<Parameter>& parameters) const;

  /// The same for a statement that gives no rows. In a transaction it is sent without a wait; the
  /// next call that waits throws its Error.
  void post(const std::string& sql, const std::vector<Parameter>& parameters) const;

  /// Undoes the transaction. Nothing happens if the server is lost, and the transaction with it.
  void roll_back() const;

  /// The first column of the first row; 0 if there is none.
  [[nodiscard]] std::int64_t integer(const std::string& sql,
                                     const std::vector<Parameter>& parameters = {}) const;

  [[nodiscard]] bool is_lost() const {
    return is_given_up_ || PQstatus(handle_.get()) != CONNECTION_OK;
  }

  /// Connects again. Statements remain valid.
  void reconnect();

  /// Waits for one of `channel`, at most so long. The first call on a connection returns at once.
  void wait_for_notification(const std::string& channel, std::chrono::milliseconds most);

  /// See MapDatabase.
  void set_time_limit(std::chrono::milliseconds limit) { limit_ = limit; }
  void interrupt() { is_interrupted_ = true; }

  /// The address without passwords.
  [[nodiscard]] const std::string& shown() const { return shown_; }

  /// Throws Error (kind input) with a clause on the map.
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  struct Finish {
    void operator()(PGconn* connection) const { PQfinish(connection); }
  };

  /// The answer to what was sent; of several, the first that is an error, or the last.
  Result answer() const;
  void flush() const;
  /// Null after the last answer.
  Result next_answer() const;
  /// Waits for the answers to what was posted. Throws the Error of the first that failed.
  void settle() const;
  void prepare(const std::string& sql, std::size_t parameters) const;
  void send(const std::string& sql, const std::vector<Parameter>& parameters) const;
  void check_not_given_up() const;
  /// Waits until the server may be read from, or written to. Throws Error.
  void wait_for_server(int events) const;
  Result checked(Result answer) const;
  [[noreturn]] void fail(const std::string& reason, const std::string& remedy) const;

  void begin();

  Address address_;
  std::string shown_;
  MapDatabase::Access access_;
  std::atomic<bool> is_interrupted_ = false;
  std::unique_ptr<PGconn, Finish> handle_;
  mutable std::map<std::string, std::string> prepared_;  ///< names by statement
  mutable int posted_ = 0;                               ///< statements without an answer so far
  std::chrono::milliseconds limit_{0};                   ///< of an answer; 0 = none
  bool is_listening_ = false;
  mutable bool is_given_up_ = false;  ///< an answer did not come in time
};

/// A statement with parameters ?1, ?2 and so on. All of its rows are in memory.
class FleetStatement final : public SqlStatement {
 public:
  FleetStatement(const Connection& connection, std::string sql);

  void bind(int number, std::int64_t value) override;
  void bind(int number, double value) override;
  void bind(int number, std::span<const unsigned char> bytes) override;
  void bind(int number, std::string_view text) override;
  void bind_null(int number) override;

  bool step() override;
  Step step_if_readable() override { return step() ? Step::row : Step::end; }
  void reset() override { result_.reset(); }
  void run() override { connection_.post(sql_, parameters_); }

  [[nodiscard]] std::int64_t integer(int column) const override;
  [[nodiscard]] double real(int column) const override;
  [[nodiscard]] bool is_null(int column) const override;
  [[nodiscard]] std::span<const unsigned char> bytes(int column) const override;

 private:
  void set(int number, Parameter value);

  const Connection& connection_;
  std::string sql_;
  std::vector<Parameter> parameters_;
  Result result_;  ///< null before the first step
  int row_ = 0;
};

}  // namespace loopbit
