// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_log.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <istream>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit {
namespace {

// Offsets in the header, sqlite.org/fileformat2.html, 1.3. The mark is at SQLite's "schema cookie".
constexpr std::size_t kWriteVersionAt = 18;
constexpr std::size_t kReadVersionAt = 19;
constexpr std::size_t kPageBytesAt = 16;
constexpr std::size_t kChangesAt = 24;
constexpr std::size_t kPagesAt = 28;
constexpr std::size_t kMarkAt = 40;
constexpr unsigned char kWithoutLog = 1;
constexpr unsigned char kWithLog = 2;

/// A mark is a random number in the upper bits; the lower bits repeat the random number of the mark
/// before. Smaller values are SQLite's own, which counts changes of tables there.
constexpr unsigned kMarkBits = 16;
constexpr std::uint32_t kLeastMark = 1U << kMarkBits;
constexpr std::uint32_t kNoMark = 0;

std::uint32_t big_endian(std::span<const unsigned char> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8U | bytes[i];
  return value;
}

std::uint32_t mark_at(std::span<const unsigned char> header) {
  const std::uint32_t value = big_endian(header, kMarkAt);
  return value < kLeastMark ? kNoMark : value;
}

bool read(std::istream& file, std::span<unsigned char> bytes) {
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return static_cast<bool>(file);
}

/// The frames of a log in order, up to the first damaged one.
class Log {
 public:
  explicit Log(const std::string& path) : file_(path, std::ios::binary) {
    std::array<unsigned char, 32> header{};
    if (!read(file_, header)) return;
    constexpr std::uint32_t kMagic = 0x377f0682;  // or one more
    if ((big_endian(header, 0) & ~1U) != kMagic) return;
    is_big_endian_ = (header[3] & 1U) != 0;
    page_bytes_ = big_endian(header, 8);
    std::copy_n(header.begin() + 16, salts_.size(), salts_.begin());
    add(std::span(header).first(24));
    constexpr std::uint32_t kMaxPageBytes = 65536;
    const bool is_whole = has_sum(std::span(header).subspan(24));
    if (is_whole && page_bytes_ >= 512 && page_bytes_ <= kMaxPageBytes) page_.resize(page_bytes_);
  }

  /// False at the end.
  bool next() {
    if (page_.empty() || !read(file_, frame_) || !read(file_, page_)) return false;
    if (!std::equal(salts_.begin(), salts_.end(), frame_.begin() + 8)) return false;
    add(std::span(frame_).first(8));
    add(page_);
    return has_sum(std::span(frame_).subspan(16));
  }

  [[nodiscard]] std::uint32_t page_bytes() const { return page_bytes_; }
  [[nodiscard]] std::uint32_t number() const { return big_endian(frame_, 0); }
  [[nodiscard]] bool ends_commit() const { return big_endian(frame_, 4) != 0; }
  [[nodiscard]] std::span<const unsigned char> page() const { return page_; }

 private:
  void add(std::span<const unsigned char> bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += 8) {
      sums_[0] += word(bytes, at) + sums_[1];
      sums_[1] += word(bytes, at + 4) + sums_[0];
    }
  }

  [[nodiscard]] std::uint32_t word(std::span<const unsigned char> bytes, std::size_t at) const {
    const std::uint32_t value = big_endian(bytes, at);
    return is_big_endian_ ? value : __builtin_bswap32(value);
  }

  [[nodiscard]] bool has_sum(std::span<const unsigned char> sums) const {
    return big_endian(sums, 0) == sums_[0] && big_endian(sums, 4) == sums_[1];
  }

  std::ifstream file_;
  bool is_big_endian_ = false;  ///< byte order of the checksums
  std::uint32_t page_bytes_ = 0;
  std::array<unsigned char, 8> salts_{};
  std::array<std::uint32_t, 2> sums_{};
  std::array<unsigned char, 24> frame_{};
  std::vector<unsigned char> page_;
};

/// What a log says about its map.
struct Origin {
  bool is_empty = true;  ///< SQLite would read nothing from it
  std::uint32_t mark = kNoMark;
  std::uint32_t page_bytes = 0;
};

/// Reads up to the map's first page, which comes first in a commit unless that is very large.
Origin origin_of(const std::string& log_path) {
  Log log(log_path);
  Origin origin;
  while (log.next()) {
    origin.page_bytes = log.page_bytes();
    origin.is_empty = origin.is_empty && !log.ends_commit();
    if (log.number() != 1) continue;
    origin.is_empty = false;
    origin.mark = mark_at(log.page());
    break;
  }
  return origin;
}

std::uint32_t page_bytes_of(const Database::Header& header) {
  const unsigned value = unsigned{header[kPageBytesAt]} << 8U | header[kPageBytesAt + 1];
  return value == 1 ? 65536 : value;
}

/// Whether a rollback with this journal gives the file as it was before its last commit. `header`:
/// of the file.
bool is_own_journal(std::istream& journal, const Database::Header& header) {
  std::array<unsigned char, 28> start{};
  constexpr std::array<unsigned char, 8> kMagic{0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7};
  if (!read(journal, start) || !std::equal(kMagic.begin(), kMagic.end(), start.begin())) {
    return true;  // SQLite ignores it
  }
  const std::uint32_t records = big_endian(start, 8);
  const std::uint32_t pages = big_endian(start, 16);
  const std::uint32_t changes = big_endian(header, kChangesAt);
  if (pages == 0) return changes <= 1 && mark_at(header) == kNoMark;  // the file was being made
  std::array<unsigned char, 4> number{};
  Database::Header before{};
  journal.seekg(big_endian(start, 20));
  if (records == 0 || !read(journal, number)) return pages == big_endian(header, kPagesAt);
  if (big_endian(number, 0) != 1 || !read(journal, before)) return false;
  const std::uint32_t mark = big_endian(header, kMarkAt);
  const std::uint32_t mark_before = big_endian(before, kMarkAt);
  const std::uint32_t changes_before = big_endian(before, kChangesAt);
  const bool is_next = mark % kLeastMark == mark_before >> kMarkBits;
  return mark == mark_before ? changes - changes_before <= 1
                             : is_next && changes - changes_before == 1;
}

std::string foreign(const std::string& file, const char* kind, const std::string& path) {
  return fmt::format(
      "'{0}' is the {1} of another map or of another copy of '{2}'. Nothing was read or written. "
      "Move the {1} away, then try again.",
      file, kind, path);
}

/// Empty, or a sentence.
std::string journal_fault(const Database& database) {
  const std::string journal_path = resolved_path(database.path()) + "-journal";
  std::ifstream journal(journal_path, std::ios::binary);
  if (is_own_journal(journal, database.header())) return "";
  return foreign(journal_path, "journal", database.path());
}

/// Empty, or a sentence.
std::string log_fault(const Database& database) {
  const Database::Header header = database.header();
  const std::string& path = database.path();
  const std::string log_path = resolved_path(path) + "-wal";
  const Origin log = origin_of(log_path);
  const bool has_log = header[kReadVersionAt] == kWithLog;
  if (log.is_empty) {
    const std::string reason = has_log ? other_name(path) : "";
    if (reason.empty()) return "";
    return fmt::format(
        "The latest data of '{0}' is in a log beside another name of the file: a run writes it "
        "under that name, or was killed. Open the map by that name. ('{0}' {1}.)",
        path, reason);
  }
  const bool is_own =
      has_log && log.page_bytes == page_bytes_of(header) && log.mark == mark_at(header);
  return is_own ? "" : foreign(log_path, "log", path);
}

}  // namespace

std::string header_fault(const Database& database) {
  const Database::Header header = database.header();
  const int write = header[kWriteVersionAt];
  const int read = header[kReadVersionAt];
  // A shorter file has no header; SQLite refuses it.
  if (header[0] == 0 || (write == read && (read == kWithoutLog || read == kWithLog))) return "";
  return fmt::format(
      "the file: its header gives SQLite's write version as {} and its read version as {}; both "
      "must be {}, or both {}",
      write, read, kWithoutLog, kWithLog);
}

void check_log(const Database& database) {
  // While a writer begins or ends its log, the two may disagree for a moment.
  constexpr int kAttempts = 5;
  constexpr std::chrono::milliseconds kPause{20};
  std::string fault;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    fault = journal_fault(database);
    if (fault.empty()) fault = log_fault(database);
    if (fault.empty()) return;
    std::this_thread::sleep_for(kPause);
  }
  throw Error(ErrorKind::input, fault);
}

void mark(const Database& database) {
  std::random_device random;
  std::uniform_int_distribution<std::int32_t> numbers(1, (1 << (31 - kMarkBits)) - 1);
  const auto before = static_cast<std::int32_t>(database.integer("PRAGMA schema_version"));
  database.set_schema_version(numbers(random) << kMarkBits | before >> kMarkBits);
}

void begin_log(const Database& database) {
  database.execute("PRAGMA journal_mode = WAL");
  write_header(database);  // so that the mark comes first, and is soon found
}

void write_header(const Database& database) {
  database.execute(
      fmt::format("PRAGMA user_version = {}", database.integer("PRAGMA user_version")));
}

bool has_log(const Database& database) {
  Statement mode(database, "PRAGMA journal_mode");
  return mode.step() && mode.text(0) == "wal";
}

bool close_log(const Database& database) {
  const auto timeout_ms = database.integer("PRAGMA busy_timeout");
  const auto attempt = [&](const char* sql) {
    try {
      Statement statement(database, sql);
      return statement.step() && statement.text(0) == "delete";
    } catch (const Error&) {  // it is locked
      return false;
    }
  };
  database.execute("PRAGMA busy_timeout = 0");
  const bool is_closed = attempt("PRAGMA journal_mode = DELETE");
  // Otherwise the file alone gets all that no reader prevents.
  if (!is_closed) attempt("PRAGMA wal_checkpoint(FULL)");
  database.execute(fmt::format("PRAGMA busy_timeout = {}", timeout_ms));
  return is_closed;
}

std::string other_name(const std::string& path) {
  struct statx status {};
  if (statx(AT_FDCWD, path.c_str(), 0, STATX_NLINK, &status) != 0) return "";
  if (status.stx_nlink > 1) return fmt::format("has {} names, as hard links", status.stx_nlink);
  if ((status.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0) return "is mounted as a single file";
  return "";
}

}  // namespace loopbit
