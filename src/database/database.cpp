// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/database.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

constexpr int kMaxRowBytes = 256 << 20;
/// How long to wait for another process that has the file locked for a moment.
constexpr int kBusyTimeout_ms = 10'000;

bool is_damage(int result) {
  const int primary = result & 0xff;
  return primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB || primary == SQLITE_IOERR;
}

/// Of the last failure: not for want of space.
bool is_forbidden(sqlite3* handle) {
  const int result = sqlite3_errcode(handle);
  return result == SQLITE_READONLY || result == SQLITE_PERM ||
         (result == SQLITE_CANTOPEN && sqlite3_system_errno(handle) != ENOSPC);
}

/// Of the last failure: the system's own words where a file could not be opened.
const char* reason_of(sqlite3* handle, const std::string& path) {
  int system_error = sqlite3_system_errno(handle);
  const bool unopened = sqlite3_errcode(handle) == SQLITE_CANTOPEN && system_error != 0;
  if (!unopened) return sqlite3_errmsg(handle);
  if (system_error == ENOENT) {
    // If SQLite cannot make a file, it tries to read it. Then only the folder tells why.
    const auto folder = std::filesystem::absolute(path).parent_path();
    if (faccessat(AT_FDCWD, folder.c_str(), W_OK, AT_EACCESS) != 0) system_error = errno;
  }
  return std::strerror(system_error);
}

}  // namespace

Database::Database(std::string path, Access access, Remedies remedies)
    : path_(std::move(path)), access_(access), remedies_(std::move(remedies)) {
  // Readers may write, too, where the system lets them: what a killed writer began has to be undone
  // before anything can be read.
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX |
                    (access == Access::create ? SQLITE_OPEN_CREATE : 0);
  sqlite3* handle = nullptr;
  const int result = sqlite3_open_v2(path_.c_str(), &handle, flags, nullptr);
  handle_.reset(handle);  // must be closed even if it could not be opened
  if (result != SQLITE_OK) fail();
  file_ = std::make_unique<OpenFile>(path_);
  sqlite3_busy_timeout(handle, kBusyTimeout_ms);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kMaxRowBytes);
  const bool reads = access == Access::read;
  // A file that was cut is read as far as it goes, which SQLite allows only where the list of
  // tables may be changed, too.
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, reads ? 0 : 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_WRITABLE_SCHEMA, reads ? 1 : 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, reads ? 1 : 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  execute("PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0");
  if (reads) execute("PRAGMA query_only = ON");
}

void Database::Close::operator()(sqlite3* handle) const { sqlite3_close(handle); }

void Database::execute(const std::string& sql) const {
  if (sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

void Database::execute_alone(const std::string& sql) const {
  constexpr int kPause_ms = 10;
  for (int waited_ms = 0;; waited_ms += kPause_ms) {
    const int result = sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr);
    if (result == SQLITE_OK) return;
    if (result != SQLITE_BUSY || waited_ms >= kBusyTimeout_ms) fail();
    sqlite3_sleep(kPause_ms);
  }
}

std::int64_t Database::integer(const std::string& sql) const {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

Database::Header Database::header() const {
  Header header{};
  sqlite3_file* file = nullptr;
  if (sqlite3_file_control(handle(), "main", SQLITE_FCNTL_FILE_POINTER, &file) != SQLITE_OK) fail();
  const int result = file->pMethods->xRead(file, header.data(), header.size(), 0);
  if (result != SQLITE_OK && result != SQLITE_IOERR_SHORT_READ) header = {};
  return header;
}

void Database::set_schema_version(std::int32_t version) const {
  sqlite3_db_config(handle(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);  // which would ignore it
  execute(fmt::format("PRAGMA schema_version = {}", version));
  sqlite3_db_config(handle(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
}

void Database::fail() const {
  const char* reason = handle_ ? reason_of(handle(), path_) : "out of memory";
  const int code = handle_ ? sqlite3_errcode(handle()) : SQLITE_NOMEM;
  const bool unusable = code == SQLITE_CORRUPT || code == SQLITE_NOTADB;
  const bool writes = access_ == Access::create && !unusable;
  std::string remedy = writes ? remedies_.write : remedies_.read;
  if (code == SQLITE_BUSY) remedy = "another program holds it; wait until that ends, or end it";
  if (handle_ && is_forbidden(handle())) {
    remedy = "check the path, and the permissions of the file and of its folder";
  }
  throw Error(writes ? ErrorKind::output : ErrorKind::input,
              fmt::format("'{}' cannot be {} ({}): {}.", path_, writes ? "written" : "read", reason,
                          remedy));
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

void Statement::bind(int parameter, double value) {
  if (sqlite3_bind_double(statement_.get(), parameter, value) != SQLITE_OK) database_.fail();
}

void Statement::bind(int parameter, std::span<const unsigned char> bytes) {
  const int result =
      sqlite3_bind_blob64(statement_.get(), parameter, bytes.data(), bytes.size(), SQLITE_STATIC);
  if (result != SQLITE_OK) database_.fail();
}

void Statement::bind(int parameter, std::string_view text) {
  const int result = sqlite3_bind_text64(statement_.get(), parameter, text.data(), text.size(),
                                         SQLITE_STATIC, SQLITE_UTF8);
  if (result != SQLITE_OK) database_.fail();
}

void Statement::bind_null(int parameter) {
  if (sqlite3_bind_null(statement_.get(), parameter) != SQLITE_OK) database_.fail();
}

bool Statement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) database_.fail();
  return false;
}

Statement::Step Statement::step_if_readable() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return Step::row;
  if (result == SQLITE_DONE) return Step::end;
  if (!is_damage(result)) database_.fail();
  return Step::damaged;
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

std::span<const unsigned char> Statement::bytes(int column) const {
  const auto* data =
      static_cast<const unsigned char*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return data ? std::span(data, static_cast<std::size_t>(size)) : std::span<const unsigned char>{};
}

void remove_database(const std::string& path) {
  std::error_code ignored;
  for (const char* suffix : kDatabaseSuffixes) std::filesystem::remove(path + suffix, ignored);
}

}  // namespace loopbit
