// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

namespace loopbit {

/// A SQLite file. Every failure is an Error that names the file; its kind is output for a writer,
/// input for a reader.
class Database {
 public:
  enum class Access { create, read };

  Database(std::string path, Access access);

  /// Runs statements that give no rows.
  void execute(const std::string& sql) const;

  [[noreturn]] void fail() const;
  [[nodiscard]] sqlite3* handle() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(sqlite3* handle) const;
  };

  std::string path_;
  Access access_;
  std::unique_ptr<sqlite3, Close> handle_;
};

/// A prepared statement. Parameters count from 1, columns from 0. The database must outlive it.
class Statement {
 public:
  Statement(const Database& database, const std::string& sql);

  void bind(int parameter, std::int64_t value);
  /// The bytes must stay where they are until the next reset().
  void bind(int parameter, std::span<const unsigned char> bytes);

  /// True if there is a row, false at the end.
  bool step();
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  /// Valid until the next step() or reset().
  [[nodiscard]] std::span<const unsigned char> bytes(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };

  const Database& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

}  // namespace loopbit
