// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace loopbit {

/// The cause of an error. The command maps each to an exit code.
enum class ErrorKind {
  option,  ///< an option, argument or command is invalid
  input,   ///< an input is missing, damaged or of the wrong kind
  output,  ///< an output could not be written
};

/// The only exception that loopbit throws on purpose. what() is one or two sentences that name the
/// thing, its value and the remedy. "No loop" is a normal result, not an error.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& sentence) : std::runtime_error(sentence), kind_(kind) {}

  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }

 private:
  ErrorKind kind_;
};

}  // namespace loopbit
