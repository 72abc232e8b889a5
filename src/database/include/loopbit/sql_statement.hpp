// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace loopbit {

/// A prepared statement of any database. Parameters are ?1, ?2 and so on; columns count from 0. The
/// database must outlive it.
class SqlStatement {
 public:
  enum class Step { row, end, damaged };

  SqlStatement() = default;
  virtual ~SqlStatement() = default;
  SqlStatement(const SqlStatement&) = delete;
  SqlStatement& operator=(const SqlStatement&) = delete;
  SqlStatement(SqlStatement&&) = default;
  SqlStatement& operator=(SqlStatement&&) = delete;

  virtual void bind(int parameter, std::int64_t value) = 0;
  virtual void bind(int parameter, double value) = 0;
  /// Bytes and text must stay where they are until the next reset().
  virtual void bind(int parameter, std::span<const unsigned char> bytes) = 0;
  virtual void bind(int parameter, std::string_view text) = 0;
  virtual void bind_null(int parameter) = 0;

  /// True if there is a row, false at the end.
  virtual bool step() = 0;
  /// The same, but what cannot be read of a damaged file or disk is no Error.
  virtual Step step_if_readable() = 0;
  virtual void reset() = 0;
  /// Runs a statement that gives no rows, and resets it. In a transaction, a server may be told
  /// later; then a later statement or the end of the transaction throws its Error.
  virtual void run() {
    step();
    reset();
  }

  [[nodiscard]] virtual std::int64_t integer(int column) const = 0;
  [[nodiscard]] virtual double real(int column) const = 0;
  [[nodiscard]] virtual bool is_null(int column) const = 0;
  /// Valid until the next step() or reset().
  [[nodiscard]] virtual std::span<const unsigned char> bytes(int column) const = 0;

  [[nodiscard]] std::string text(int column) const {
    const auto characters = bytes(column);
    return {characters.begin(), characters.end()};
  }
};

}  // namespace loopbit
