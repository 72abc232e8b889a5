// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_options.hpp"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kSections{"binary_content", "surf"};

/// The sections of `json` that determine places.
Json shape_of(const std::string& path, const std::string& json) {
  // Settings are not nested deeper, and printing deep JSON would overflow the stack.
  const auto is_shallow = [](int depth, Json::parse_event_t /*event*/, const Json& /*value*/) {
    constexpr int kSettings = 2;
    return depth <= kSettings;
  };
  const Json all = Json::parse(json, is_shallow, false);
  Json shape;
  for (const char* section : kSections) {
    if (!all.is_object() || !all.contains(section) || !all[section].is_object()) {
      throw Error(
          ErrorKind::input,
          fmt::format("'{}' does not say with which {} settings it was made: it is damaged; "
                      "'loopbit map check' says what is left.",
                      path, section));
    }
    shape[section] = all[section];
  }
  return shape;
}

template <typename Part>
void check_part(const std::string& path, const char* section, const Part& map,
                const Part& detector) {
  for_each_field<Part>([&](const auto& field) {
    const auto theirs = map.*field.member;
    const auto ours = detector.*field.member;
    if (ours == theirs) return;
    throw Error(ErrorKind::option,
                fmt::format("{0}.{1} is {2}, but '{3}' was made with {0}.{1} = {4}: places could "
                            "not be compared; give the detector the options of the map.",
                            section, field.name, ours, path, theirs));
  });
}

}  // namespace

void check_same_shape(const std::string& path, const std::string& json,
                      const LoopDetectorOptions& options) {
  const Json map = shape_of(path, json);
  const Json run = shape_of(path, to_json(options));
  for (const char* section : kSections) {
    for (const auto& [name, value] : map[section].items()) {
      if (!run[section].contains(name)) {
        throw Error(ErrorKind::input,
                    fmt::format("'{}' was made with a setting {}.{}, which this loopbit does not "
                                "know; use the newer loopbit that made it.",
                                path, section, name));
      }
    }
    for (const auto& [name, value] : run[section].items()) {
      if (map[section].contains(name) && map[section][name] == value) continue;
      const std::string theirs =
          map[section].contains(name) ? map[section][name].dump() : "no such setting";
      throw Error(
          ErrorKind::option,
          fmt::format("'{}' was made with {}.{} = {}, but this run has {}: its places could "
                      "not be compared; use --set {}.{}={}, or another map.",
                      path, section, name, theirs, value.dump(), section, name, theirs));
    }
  }
}

void check_detector(const std::string& path, const LoopDetectorOptions& made_with,
                    const LoopDetectorOptions& detector) {
  check_part(path, kSections[0], made_with.binary_content, detector.binary_content);
  check_part(path, kSections[1], made_with.surf, detector.surf);
}

LoopDetectorOptions options_of_shape(const std::string& path, const std::string& json) {
  try {
    return options_from_json(shape_of(path, json).dump(), fmt::format("'{}'", path));
  } catch (const Error& error) {
    throw Error(ErrorKind::input,
                fmt::format("{} The map is damaged, or was made by another version of loopbit.",
                            error.what()));
  }
}

}  // namespace loopbit
