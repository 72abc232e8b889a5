// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>

namespace loopbit {

/// The address of a database, "postgresql://user@host/database", as libpq reads it.
class Address {
 public:
  /// Throws Error (kind option), whose message shows nothing that could be secret.
  explicit Address(const std::string& uri);

  /// Without passwords.
  [[nodiscard]] const std::string& shown() const { return shown_; }

  /// Of the database, else of the service; fit to begin a file name.
  [[nodiscard]] std::string name() const;

  /// With passwords. Only a connection may see it.
  [[nodiscard]] const std::string& uri() const { return uri_; }

 private:
  std::string uri_;
  std::map<std::string, std::string> settings_;  ///< but for passwords
  std::string shown_;
};

}  // namespace loopbit
