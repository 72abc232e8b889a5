// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "database.hpp"

#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "loopbit/error.hpp"

namespace loopbit {

Database::Database(std::string path, Access access) : path_(std::move(path)), access_(access) {
  const int flags =
      access == Access::create ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  sqlite3* handle = nullptr;
  const int result = sqlite3_open_v2(path_.c_str(), &handle, flags, nullptr);
  handle_.reset(handle);  // must be closed even if it could not be opened
  if (result != SQLITE_OK) fail();
}

void Database::Close::operator()(sqlite3* handle) const { sqlite3_close(handle); }

void Database::execute(const std::string& sql) const {
  if (sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

void Database::fail() const {
  const char* reason = handle_ ? sqlite3_errmsg(handle()) : "out of memory";
  if (access_ == Access::create) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' cannot be written ({}): check the free space and the "
                            "permissions of its folder, or run without it, by --no-report.",
                            path_, reason));
  }
  throw Error(ErrorKind::input,
              fmt::format("'{}' cannot be read ({}): it is damaged or no file of loopbit's; delete "
                          "it to go on without it.",
                          path_, reason));
}

Statement::Statement(const Database& database, const std::string& sql) : database_(database) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    database.fail();
  }
  statement_.reset(statement);
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

void Statement::bind(int parameter, std::int64_t value) {
  if (sqlite3_bind_int64(statement_.get(), parameter, value) != SQLITE_OK) database_.fail();
}

void Statement::bind(int parameter, std::span<const unsigned char> bytes) {
  const int result =
      sqlite3_bind_blob64(statement_.get(), parameter, bytes.data(), bytes.size(), SQLITE_STATIC);
  if (result != SQLITE_OK) database_.fail();
}

bool Statement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) database_.fail();
  return false;
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::span<const unsigned char> Statement::bytes(int column) const {
  const auto* data =
      static_cast<const unsigned char*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return data ? std::span(data, static_cast<std::size_t>(size)) : std::span<const unsigned char>{};
}

}  // namespace loopbit
