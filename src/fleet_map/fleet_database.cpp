// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "fleet_database.hpp"

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "fleet_schema.hpp"

namespace loopbit {
namespace {

/// The version of a map file with the same tables.
constexpr int kFileVersion = 4;

/// Places of 0.6 KB each.
constexpr std::int64_t kRowsAtOnce = 1024;

/// Advisory locks belong to one database and end with the connection. Their first key is "loop" in
/// ASCII, the second one the number of a session that is being written, or one of these. The lock
/// of end_batch() is 0.
constexpr const char* kLockNumbers = "SELECT pg_advisory_xact_lock(1819242352, -1)";
constexpr const char* kLockLinks = "SELECT pg_try_advisory_lock(1819242352, -2)";
constexpr const char* kLockSession = "SELECT pg_advisory_lock(1819242352, $1::bigint::integer)";
constexpr const char* kTrySession = "SELECT pg_try_advisory_lock(1819242352, $1::bigint::integer)";
constexpr const char* kCountLocked =
    "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND objsubid = 2 AND classid = "
    "1819242352 AND objid::bigint BETWEEN 1 AND $1 AND database = (SELECT oid FROM pg_database "
    "WHERE datname = current_database())";
constexpr const char* kEndHolders =
    "SELECT pg_terminate_backend(pid) FROM pg_locks WHERE locktype = 'advisory' AND objsubid = 2 "
    "AND classid = 1819242352 AND objid::bigint = $1 AND pid <> pg_backend_pid() AND database = "
    "(SELECT oid FROM pg_database WHERE datname = current_database())";
/// Sessions that were moved here keep their numbers.
constexpr const char* kNumbers =
    "SELECT number FROM (SELECT nextval('session_number') AS number FROM generate_series(1, "
    "$1::bigint)) AS drawn WHERE number NOT IN (SELECT session FROM session)";
constexpr std::int64_t kMaxSession = 2'147'483'647;

}  // namespace

/// One that is part of another does nothing.
class FleetDatabase::OpenTransaction final : public Transaction {
 public:
  OpenTransaction(const FleetDatabase& database, const char* begin, std::string end)
      : database_(database), is_outer_(!database.in_transaction_), end_(std::move(end)) {
    if (!is_outer_) return;
    database.connection_.execute(begin);
    database.in_transaction_ = true;
  }

  ~OpenTransaction() override {
    if (!is_outer_ || has_ended_) return;
    database_.in_transaction_ = false;
    database_.connection_.roll_back();
  }

  OpenTransaction(const OpenTransaction&) = delete;
  OpenTransaction& operator=(const OpenTransaction&) = delete;
  OpenTransaction(OpenTransaction&&) = delete;
  OpenTransaction& operator=(OpenTransaction&&) = delete;

  void end() override {
    if (!is_outer_) return;
    database_.connection_.execute(end_);
    database_.in_transaction_ = false;
    has_ended_ = true;
  }

 private:
  const FleetDatabase& database_;
  bool is_outer_;
  bool has_ended_ = false;
  std::string end_;
};

FleetDatabase::FleetDatabase(const Address& address, Access access) : connection_(address, access) {
  check_version(connection_);
  if (access != Access::link) return;
  const bool is_linked = connection_.integer(kLockLinks) == 0;
  if (!is_linked && !is_being_written()) return;
  throw Error(ErrorKind::output,
              fmt::format("'{}' is being {} by another program; wait until that ends.",
                          connection_.shown(), is_linked ? "linked" : "written"));
}

int FleetDatabase::version() const { return kFileVersion; }

std::unique_ptr<SqlStatement> FleetDatabase::prepare(const std::string& sql) const {
  return std::make_unique<FleetStatement>(connection_, sql);
}

std::int64_t FleetDatabase::rows_at_once() const { return kRowsAtOnce; }

std::unique_ptr<MapDatabase::Transaction> FleetDatabase::begin() const {
  return std::make_unique<OpenTransaction>(*this, "BEGIN; SELECT nextval('batch_number')",
                                           "SELECT end_batch(); COMMIT");
}

std::unique_ptr<MapDatabase::Transaction> FleetDatabase::snapshot() const {
  return std::make_unique<OpenTransaction>(*this, "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY",
                                           "COMMIT");
}

std::vector<int> FleetDatabase::new_sessions(std::size_t number) const {
  std::vector<int> sessions;
  while (sessions.size() < number) {
    const Result rows =
        connection_.run(kNumbers, {parameter(static_cast<std::int64_t>(number - sessions.size()))});
    for (int row = 0; row < PQntuples(rows.get()); ++row) {
      sessions.push_back(static_cast<int>(integer_in(*rows, row, 0)));
    }
  }
  return sessions;
}

MapDatabase::NewSession FleetDatabase::begin_session() const {
  OpenTransaction numbering(*this, "BEGIN", "COMMIT");
  connection_.execute(kLockNumbers);
  const int session = new_sessions(1).front();
  connection_.run(kLockSession, {parameter(session)});
  const bool is_linked = connection_.integer(kCountLocked, {parameter(session - 1)}) == 0;
  numbering.end();
  session_ = session;
  return {.session = session, .is_linked = is_linked};
}

bool FleetDatabase::hold_session(int session) const {
  return connection_.integer(kTrySession, {parameter(session)}) != 0;
}

std::int64_t FleetDatabase::place_key(const SessionFrame& at, std::int64_t /*previous*/) const {
  constexpr std::int64_t kFrames = std::int64_t{1} << 32U;
  return at.session * kFrames + at.frame;
}

bool FleetDatabase::is_being_written() const {
  return connection_.integer(kCountLocked, {parameter(kMaxSession)}) > 0;
}

bool FleetDatabase::has_search() const {
  return connection_.integer(
             "SELECT count(*) FROM pg_index JOIN pg_class ON pg_class.oid = indexrelid JOIN pg_am "
             "ON pg_am.oid = relam WHERE indrelid = 'loopbit.place'::regclass AND indisvalid AND "
             "amname = 'loopbit' AND to_regtype('loopbit.binary_content') IS NOT NULL") > 0;
}

void FleetDatabase::reconnect() {
  connection_.reconnect();
  in_transaction_ = false;
  if (session_ == 0) return;
  // The server may not know yet that the connection before is gone.
  connection_.run(kEndHolders, {parameter(session_)});
  connection_.run(kLockSession, {parameter(session_)});
}

std::int64_t FleetDatabase::epoch() const {
  return connection_.integer("SELECT coalesce(max(epoch), 0) FROM batch");
}

void FleetDatabase::wait_for_commit(std::chrono::milliseconds most) {
  connection_.wait_for_notification("loopbit_batch", most);
}

void FleetDatabase::hold_back_commits() const {
  connection_.execute("SELECT pg_advisory_xact_lock(1819242352, 0)");
}

std::int64_t FleetDatabase::bytes() const {
  return connection_.integer(
      "SELECT coalesce(sum(pg_total_relation_size(oid)), 0)::bigint FROM pg_class WHERE relkind = "
      "'r' AND relnamespace = 'loopbit'::regnamespace");
}

}  // namespace loopbit
