// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace loopbit {

/// What has to change for the call to succeed. The command line maps each to an exit code.
enum class ErrorKind {
  option,  ///< an option, argument or command has a bad value
  input,   ///< something to be read is missing, damaged or of the wrong kind
  output,  ///< something could not be written
};

/// The only exception loopbit throws on purpose. what() is one sentence or two that name the thing,
/// its value and the remedy. "No loop" is a normal result and never an error.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& sentence) : std::runtime_error(sentence), kind_(kind) {}

  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }

 private:
  ErrorKind kind_;
};

/// The Error (kind output) of a file or folder that cannot be written: its name, the reason that
/// `errno_value` stands for, the remedy, and what is `kept`, if there is something to say of that.
Error cannot_write(const std::string& path, int errno_value, const std::string& kept = "");

}  // namespace loopbit
