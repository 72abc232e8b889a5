// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_server.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "loopbit/error.hpp"

#include "file_database.hpp"
#include "map_schema.hpp"

namespace loopbit {
namespace {

constexpr std::array<std::string_view, 2> kSchemes{"postgresql://", "postgres://"};

std::unique_ptr<const MapServer>& the_server() {
  static std::unique_ptr<const MapServer> server;
  return server;
}

const MapServer& server() {
  if (the_server()) return *the_server();
  throw Error(
      ErrorKind::option,
      fmt::format("'{}...' is a map on a server, which only the loopbit command can use, if "
                  "it was built with LOOPBIT_BUILD_FLEET; give a map file.",
                  kSchemes.front()));
}

/// Where the address of a map begins; npos if there is none.
std::size_t find_address(const std::string& text) {
  std::size_t first = std::string::npos;
  for (const std::string_view scheme : kSchemes) first = std::min(first, text.find(scheme));
  return first;
}

/// Throws Error (kind option) for several.
const std::string& one_address(const std::string& path) {
  if (addresses_in(path).size() == 1) return path;
  throw Error(ErrorKind::option,
              fmt::format("'{}' are several maps, which only 'loopbit run', 'loopbit query' and "
                          "'loopbit map info|list|check' (without --recover) take; give one.",
                          without_secrets(path)));
}

}  // namespace

void set_map_server(std::unique_ptr<const MapServer> server) { the_server() = std::move(server); }

bool is_map_address(const std::string& path) { return find_address(path) == 0; }

std::vector<std::string> addresses_in(const std::string& path) {
  std::istringstream words(path);
  std::vector<std::string> all{std::istream_iterator<std::string>(words), {}};
  const bool are_addresses = all.size() > 1 && std::ranges::all_of(all, is_map_address);
  return are_addresses ? all : std::vector{path};
}

bool create_map(const std::string& address, int first_session) {
  if (is_map_address(address)) return server().create(one_address(address), first_session);
  throw Error(ErrorKind::option,
              fmt::format("'{}' is not the address of a server (postgresql://...); a map file is "
                          "made by 'loopbit run INPUT --map {}'.",
                          address, address));
}

std::string map_stem(const std::string& path) {
  if (is_map_address(path)) return server().name(addresses_in(path).front());
  return std::filesystem::path(path).replace_extension().string();
}

std::string without_secrets(const std::string& text) {
  if (const auto all = addresses_in(text); all.size() > 1) {
    std::vector<std::string> shown;
    std::ranges::transform(all, std::back_inserter(shown), without_secrets);
    return fmt::format("{}", fmt::join(shown, " "));
  }
  const std::size_t at = find_address(text);
  if (at == std::string::npos) return text;
  const std::string shown =
      the_server() ? the_server()->shown(text.substr(at)) : fmt::format("{}...", kSchemes.front());
  return text.substr(0, at) + shown;
}

std::unique_ptr<MapDatabase> open_map(const std::string& path, MapDatabase::Access access) {
  if (is_map_address(path)) return server().open(one_address(path), access);
  return std::make_unique<FileDatabase>(access == MapDatabase::Access::read
                                            ? open_map_for_reading(path)
                                            : open_map_for_writing(path));
}

}  // namespace loopbit
