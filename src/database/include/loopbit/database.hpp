// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "loopbit/open_file.hpp"
#include "loopbit/sql_statement.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace loopbit {

/// SQLite keeps a database in a file and, while it is written or after a crash, in those beside it.
inline constexpr std::array kDatabaseSuffixes{"", "-wal", "-shm", "-journal"};

/// Removes those files; what cannot be removed stays.
void remove_database(const std::string& path);

/// A SQLite file. Every failure is an Error that names the file and a remedy; its kind is output
/// where something could not be written, else input. What a file says is never trusted: a hostile
/// one may give wrong rows, but runs no code and takes no more than 256 MiB for a row. For one
/// thread at a time, with its statements.
///
/// SQLiteCpp would not replace it: it closes a file that cannot be opened before the system's
/// reason can be asked for. The limits, the reading past damage and the remedies, most of this
/// file, would have to be built around it all the same.
class Database {
 public:
  enum class Access {
    create,  ///< for writing; made if it does not exist
    read,
  };

  /// Clauses that end the sentence of an error.
  struct Remedies {
    std::string write;
    std::string read;  ///< also where a file to be written is damaged
  };

  /// The bytes that begin every SQLite file.
  using Header = std::array<unsigned char, 100>;

  Database(std::string path, Access access, Remedies remedies);

  /// Runs statements that give no rows.
  void execute(const std::string& sql) const;
  /// The same where nobody else may have the file open, for which SQLite does not wait by itself.
  void execute_alone(const std::string& sql) const;

  /// The first column of the first row of what `sql` gives; 0 where there is none.
  [[nodiscard]] std::int64_t integer(const std::string& sql) const;

  /// Those of the file itself, whatever is in its log, which is not opened; zeros in a shorter one.
  [[nodiscard]] Header header() const;

  /// Sets the number in the file's header that otherwise counts changes of its tables.
  void set_schema_version(std::int32_t version) const;

  /// The file, and the right to write it.
  [[nodiscard]] OpenFile& file() const { return *file_; }

  [[noreturn]] void fail() const;
  [[nodiscard]] sqlite3* handle() const { return handle_.get(); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  struct Close {
    void operator()(sqlite3* handle) const;
  };

  std::string path_;
  Access access_;
  Remedies remedies_;
  std::unique_ptr<OpenFile> file_;  ///< outlives the handle
  std::unique_ptr<sqlite3, Close> handle_;
};

/// A prepared statement of a Database.
class Statement final : public SqlStatement {
 public:
  Statement(const Database& database, const std::string& sql);

  void bind(int parameter, std::int64_t value) override;
  void bind(int parameter, double value) override;
  void bind(int parameter, std::span<const unsigned char> bytes) override;
  void bind(int parameter, std::string_view text) override;
  void bind_null(int parameter) override;

  bool step() override;
  Step step_if_readable() override;
  void reset() override;

  [[nodiscard]] std::int64_t integer(int column) const override;
  [[nodiscard]] double real(int column) const override;
  [[nodiscard]] bool is_null(int column) const override;
  [[nodiscard]] std::span<const unsigned char> bytes(int column) const override;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };

  const Database& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

}  // namespace loopbit
