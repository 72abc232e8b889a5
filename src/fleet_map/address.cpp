// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "address.hpp"

#include <algorithm>
#include <cctype>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <libpq-fe.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

constexpr const char* kScheme = "postgresql://";

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};

/// libpq quotes what it did not understand, which may be secret.
std::string unquoted(const char* message) {
  const std::string_view text = message ? message : "out of memory";
  std::string_view clause = text.substr(0, text.find('"'));
  while (!clause.empty() &&
         std::string_view(": \n").find(clause.back()) != std::string_view::npos) {
    clause.remove_suffix(1);
  }
  return std::string(clause);
}

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorKind::option,
              fmt::format("'{}...' is not a valid address of a server ({}): write it as "
                          "postgresql://USER@HOST:PORT/DATABASE, with %40 for @ and %2F for / in a "
                          "name or password.",
                          kScheme, why));
}

/// RFC 3986, 2.1.
std::string percent_encoded(const std::string& text) {
  constexpr std::string_view kPlain = "-._~,";  // the last one between several hosts
  std::string encoded;
  for (const char letter : text) {
    const auto byte = static_cast<unsigned char>(letter);
    const bool is_plain = std::isalnum(byte) != 0 || kPlain.find(letter) != std::string_view::npos;
    encoded += is_plain ? std::string(1, letter) : fmt::format("%{:02X}", byte);
  }
  return encoded;
}

using Settings = std::map<std::string, std::string>;

/// All settings of an address but its passwords.
Settings settings_in(const std::string& uri) {
  char* error = nullptr;
  const std::unique_ptr<PQconninfoOption, FreeOptions> options(
      PQconninfoParse(uri.c_str(), &error));
  const std::unique_ptr<char, decltype(&PQfreemem)> message(error, PQfreemem);
  if (!options) refuse(unquoted(error));
  Settings settings;
  for (const PQconninfoOption* option = options.get(); option->keyword; ++option) {
    const bool is_secret = std::string_view(option->dispchar) == "*";
    if (option->val && !is_secret) settings[option->keyword] = option->val;
  }
  return settings;
}

/// A password with an @, / or : that is not encoded may reach other settings.
void check_separators(const Settings& settings) {
  for (const char* name : {"host", "dbname"}) {
    const auto found = settings.find(name);
    if (found != settings.end() && found->second.find('@') != std::string::npos) {
      refuse(fmt::format("its {} has an @", name));
    }
  }
  const auto port = settings.find("port");
  if (port == settings.end()) return;
  if (port->second.find_first_not_of("0123456789,") != std::string::npos) {
    refuse("its port is not a number");
  }
}

std::string uri_of(Settings settings) {
  const auto take = [&](const char* name, const char* before, const char* after) {
    const auto found = settings.extract(name);
    if (found.empty() || found.mapped().empty()) return std::string();
    return before + percent_encoded(found.mapped()) + after;
  };
  std::string uri = kScheme + take("user", "", "@");
  uri += take("host", "", "");
  uri += take("port", ":", "");
  uri += take("dbname", "/", "");
  char separator = '?';
  for (const auto& [name, value] : settings) {
    uri += fmt::format("{}{}={}", separator, name, percent_encoded(value));
    separator = '&';
  }
  return uri;
}

}  // namespace

Address::Address(const std::string& uri) : uri_(uri), settings_(settings_in(uri)) {
  check_separators(settings_);
  shown_ = uri_of(settings_);
}

std::string Address::name() const {
  for (const char* key : {"dbname", "service"}) {
    const auto found = settings_.find(key);
    if (found == settings_.end() || found->second.empty()) continue;
    std::string name = found->second;
    std::replace(name.begin(), name.end(), '/', '_');
    return name;
  }
  return "map";
}

}  // namespace loopbit
