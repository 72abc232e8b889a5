// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "file_database.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <numeric>

#include "map_log.hpp"
#include "map_schema.hpp"

namespace loopbit {
namespace {

class FileTransaction final : public MapDatabase::Transaction {
 public:
  explicit FileTransaction(const Database& file) : commit_(file) {}
  void end() override { commit_.end(); }

 private:
  Commit commit_;
};

/// Each statement reads what was committed before it. A writer has the file to itself, and what
/// others read of it needs no more.
class NoTransaction final : public MapDatabase::Transaction {
 public:
  void end() override {}
};

/// The next free key. The sequence alone is enough unless the map is damaged.
std::int64_t next_key(const Database& file, const std::string& table) {
  return 1 + std::max(file.integer("SELECT max(" + table + ") FROM " + table),
                      file.integer("SELECT seq FROM sqlite_sequence WHERE name = '" + table + "'"));
}

}  // namespace

int FileDatabase::version() const { return static_cast<int>(file_.integer("PRAGMA user_version")); }

std::unique_ptr<SqlStatement> FileDatabase::prepare(const std::string& sql) const {
  return std::make_unique<Statement>(file_, sql);
}

std::int64_t FileDatabase::rows_at_once() const { return std::numeric_limits<std::int64_t>::max(); }

std::unique_ptr<MapDatabase::Transaction> FileDatabase::snapshot() const {
  return std::make_unique<NoTransaction>();
}

std::unique_ptr<MapDatabase::Transaction> FileDatabase::begin() const {
  return std::make_unique<FileTransaction>(file_);
}

void FileDatabase::prepare_long_transaction() const {
  if (has_log(file_)) return;  // readers see what was there before
  mark(file_);
  begin_log(file_);
}

MapDatabase::NewSession FileDatabase::begin_session() const {
  return {.session = new_sessions(1).front()};
}

std::vector<int> FileDatabase::new_sessions(std::size_t number) const {
  const auto first = static_cast<int>(next_key(file_, "session"));
  std::vector<int> sessions(number);
  std::iota(sessions.begin(), sessions.end(), first);
  return sessions;
}

bool FileDatabase::hold_session(int /*session*/) const { return true; }  // a file has one writer

std::int64_t FileDatabase::place_key(const SessionFrame& /*at*/, std::int64_t previous) const {
  return previous > 0 ? previous + 1 : next_key(file_, "place");
}

std::int64_t FileDatabase::bytes() const {
  return static_cast<std::int64_t>(std::filesystem::file_size(path()));
}

std::string FileDatabase::fault() const { return header_fault(file_); }

std::vector<std::string> FileDatabase::structure_faults() const {
  std::vector<std::string> faults;
  Statement rows(file_, "PRAGMA integrity_check");
  Statement::Step step = rows.step_if_readable();
  for (; step == Statement::Step::row; step = rows.step_if_readable()) {
    if (rows.text(0) != "ok") faults.push_back(rows.text(0));
  }
  if (step == Statement::Step::damaged) faults.emplace_back("the file cannot be read to its end");
  return faults;
}

void FileDatabase::close() { close_log(file_); }

}  // namespace loopbit
