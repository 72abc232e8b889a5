// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/detection.hpp"
#include "loopbit/sql_statement.hpp"

namespace loopbit {

/// Where the tables of a map are, as docs/format.md describes them. All SQL for these tables runs
/// through this interface; what differs between databases is behind it. For one thread at a time.
class MapDatabase {
 public:
  enum class Access {
    read,
    write,  ///< for new sessions
    link,   ///< for new loops of earlier sessions, by one program at a time
  };

  /// A session that begins.
  struct NewSession {
    int session = 0;
    /// Whether all earlier sessions are whole, so that its frames are compared with all of theirs.
    bool is_linked = true;
  };

  /// Is rolled back unless end() is called.
  class Transaction {
   public:
    Transaction() = default;
    virtual ~Transaction() = default;
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;
    Transaction(Transaction&&) = delete;
    Transaction& operator=(Transaction&&) = delete;

    /// Commits. The rows are on disk when this returns.
    virtual void end() = 0;
  };

  MapDatabase() = default;
  virtual ~MapDatabase() = default;
  MapDatabase(const MapDatabase&) = delete;
  MapDatabase& operator=(const MapDatabase&) = delete;
  MapDatabase(MapDatabase&&) = delete;
  MapDatabase& operator=(MapDatabase&&) = delete;

  /// The map's name for messages.
  [[nodiscard]] virtual const std::string& path() const = 0;

  /// The version of its tables; see kMapVersion.
  [[nodiscard]] virtual int version() const = 0;

  [[nodiscard]] virtual std::unique_ptr<SqlStatement> prepare(const std::string& sql) const = 0;

  /// How many rows a statement should give at most, since they may all be held in memory.
  [[nodiscard]] virtual std::int64_t rows_at_once() const = 0;

  /// As long as it lives, all that is read was committed before.
  [[nodiscard]] virtual std::unique_ptr<Transaction> snapshot() const = 0;

  /// Begins to write. Throws Error (kind output).
  [[nodiscard]] virtual std::unique_ptr<Transaction> begin() const = 0;

  /// Call this before a transaction with many rows, so that readers need not wait for it.
  virtual void prepare_long_transaction() const = 0;

  /// Begins a session, which counts as being written until this database is gone. What is read by
  /// a snapshot that is taken later is all that the session's frames are compared with.
  [[nodiscard]] virtual NewSession begin_session() const = 0;

  /// Makes an earlier session count as being written until this database is gone. False if another
  /// program writes it.
  [[nodiscard]] virtual bool hold_session(int session) const = 0;

  /// The numbers of new sessions, ascending, which are written in one transaction.
  [[nodiscard]] virtual std::vector<int> new_sessions(std::size_t number) const = 0;

  /// The key of a place that is added after the one with the key `previous`; 0 = the first to be
  /// added. Successive frames of a session have successive keys.
  [[nodiscard]] virtual std::int64_t place_key(const SessionFrame& at,
                                               std::int64_t previous) const = 0;

  /// Whether a program, this one or another, writes sessions to the map.
  [[nodiscard]] virtual bool is_being_written() const = 0;

  /// Its size on disk.
  [[nodiscard]] virtual std::int64_t bytes() const = 0;

  /// Empty, or a fault for which it cannot be written.
  [[nodiscard]] virtual std::string fault() const = 0;

  /// The faults of its structure. Reads all of it.
  [[nodiscard]] virtual std::vector<std::string> structure_faults() const = 0;

  /// Whether similar places can be found by an index of the database, by `<~>` of docs/fleet.md.
  [[nodiscard]] virtual bool has_search() const = 0;

  /// Whether a server no longer answers. Then a transaction is lost, unless end() was called: it
  /// may have been committed or not.
  [[nodiscard]] virtual bool is_lost() const = 0;

  /// Reaches the server again, for the same statements and sessions. Throws Error if it cannot.
  virtual void reconnect() = 0;

  /// A server that answers later than this counts as lost; 0 = it may take any time.
  virtual void set_time_limit(std::chrono::milliseconds limit) = 0;

  /// Whatever waits for a server, now or later, ends at once with an Error. For any thread.
  virtual void interrupt() = 0;

  /// The number of the latest commit, in the order of all; 0 if they have none.
  [[nodiscard]] virtual std::int64_t epoch() const = 0;

  /// Waits until anyone has committed something since the last call, but no longer than `most`. The
  /// first call returns at once.
  virtual void wait_for_commit(std::chrono::milliseconds most) = 0;

  /// Until the transaction ends, no other one is committed.
  virtual void hold_back_commits() const = 0;

  /// Call this when all is written, and nothing is read through it any more.
  virtual void close() = 0;
};

}  // namespace loopbit
