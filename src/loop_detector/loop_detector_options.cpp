// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_detector_options.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "loopbit/error.hpp"
#include "loopbit/read_file.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

/// Of a settings file.
constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;

template <typename Visit>
void for_each_setting(LoopDetectorOptions& options, Visit&& visit) {
  for_each_section(options, [&](std::string_view section, auto& part) {
    using Part = std::remove_cvref_t<decltype(part)>;
    for_each_field<Part>([&](const auto& field) { visit(section, field, part.*field.member); });
  });
}

/// Where and why, without the library's own codes.
std::string parse_context(const Json::exception& error) {
  const std::string what = error.what();
  const auto colon = what.find("at line");
  return colon == std::string::npos ? what : what.substr(colon);
}

/// A JSON value as set_option would take it.
std::string to_text(const std::string& name, const Json& value) {
  if (value.is_boolean() || value.is_number()) return value.dump();
  throw Error(ErrorKind::option,
              fmt::format("{} is {}, but must be a number or a truth value.", name, value.dump()));
}

void check_is_section(const LoopDetectorOptions& options, const std::string& name) {
  std::vector<std::string_view> names;
  for_each_section(options,
                   [&](std::string_view known, const auto& /*part*/) { names.push_back(known); });
  if (std::find(names.begin(), names.end(), name) != names.end()) return;
  throw Error(ErrorKind::option, fmt::format("There is no section '{}'; the sections are: {}.",
                                             name, fmt::join(names, " ")));
}

void set_all(LoopDetectorOptions& options, const Json& json) {
  for (const auto& [section, settings] : json.items()) {
    check_is_section(options, section);
    if (!settings.is_object()) {
      throw Error(ErrorKind::option, fmt::format("'{}' is {}, but must be an object of settings.",
                                                 section, settings.dump()));
    }
    for (const auto& [field, value] : settings.items()) {
      const std::string name = fmt::format("{}.{}", section, field);
      set_option(options, name, to_text(name, value));
    }
  }
}

}  // namespace

LoopDetectorOptions preset(std::string_view name) {
  LoopDetectorOptions options;
  if (name == "default") return options;
  if (name != "paper") {
    throw Error(ErrorKind::option, fmt::format("There is no preset '{}'; the presets are: {}.",
                                               name, fmt::join(kPresets, " ")));
  }
  options.retrieval = {.max_candidates = 1000,
                       .min_similarity = 0.5,
                       .shift_tolerance_columns = 0,
                       .min_spacing = 1,
                       .max_center_distance_px = 4};
  options.surf.upright = false;
  options.verification.max_closer_looks = options.retrieval.max_candidates;
  options.decision.min_score = 30;
  options.decision.count_matches = true;
  return options;
}

void validate(const LoopDetectorOptions& options) {
  for_each_section(options,
                   [](std::string_view section, const auto& part) { validate(part, section); });
  if (options.exclusion.frames > 0 && options.exclusion.seconds > 0) {
    throw Error(ErrorKind::option,
                fmt::format("exclusion.frames is {} and exclusion.seconds is {}, but only one of "
                            "them can fix the window; set the other to 0.",
                            options.exclusion.frames, options.exclusion.seconds));
  }
  const DecisionOptions& decision = options.decision;
  if (decision.count_matches ? decision.min_score < 1 : decision.min_score > 1) {
    throw Error(
        ErrorKind::option,
        fmt::format("decision.min_score is {}, but with decision.count_matches={} it must be {}.",
                    decision.min_score, decision.count_matches,
                    decision.count_matches ? "a number of matches, at least 1"
                                           : "a probability, at most 1"));
  }
}

void set_option(LoopDetectorOptions& options, const std::string& name, const std::string& value) {
  const auto dot = std::min(name.find('.'), name.size());
  const std::string field = name.substr(std::min(dot + 1, name.size()));
  bool found = false;
  for_each_section(options, [&](std::string_view section, auto& part) {
    if (section == name.substr(0, dot)) found = set_field(part, section, field, value);
  });
  if (found) return;
  std::string names;
  for (const OptionInfo& option : list_options()) names += ' ' + option.name;
  throw Error(ErrorKind::option,
              fmt::format("There is no setting '{}'; the settings are:{}.", name, names));
}

std::string to_json(const LoopDetectorOptions& options) {
  Json json;
  LoopDetectorOptions copy = options;
  for_each_setting(copy, [&](std::string_view section, const auto& field, const auto& setting) {
    json[std::string(section)][std::string(field.name)] = setting;
  });
  return json.dump(2);
}

LoopDetectorOptions options_from_json(const std::string& json, const std::string& source) {
  constexpr int kMaxDepth = 8;
  std::array<std::set<std::string>, kMaxDepth + 2> names;  // of the present object at each depth
  const auto check = [&](int depth, Json::parse_event_t event, const Json& value) {
    // A message that shows a value recurses into it.
    if (depth > kMaxDepth) {
      throw Error(
          ErrorKind::option,
          fmt::format("The settings are nested more than {} deep; they are a JSON object of "
                      "sections, each an object of settings.",
                      kMaxDepth));
    }
    const auto level = static_cast<std::size_t>(depth);
    if (event == Json::parse_event_t::object_start) names.at(level + 1).clear();
    if (event == Json::parse_event_t::key &&
        !names.at(level).insert(value.get<std::string>()).second) {
      throw Error(ErrorKind::option,
                  fmt::format("'{}' stands twice in one object; write all that belongs to it once.",
                              value.get<std::string>()));
    }
    return true;
  };
  LoopDetectorOptions options;
  try {
    const Json parsed = Json::parse(json, check, true, true);
    if (!parsed.is_object()) {
      throw Error(ErrorKind::option, "The settings must be a JSON object of sections.");
    }
    set_all(options, parsed);
    validate(options);
  } catch (const Json::exception& error) {
    throw Error(ErrorKind::option,
                fmt::format("{} is not valid JSON: {}.", source, parse_context(error)));
  } catch (const Error& error) {
    throw Error(ErrorKind::option, fmt::format("{}: {}", source, error.what()));
  }
  return options;
}

LoopDetectorOptions load_options(const std::string& path) {
  return options_from_json(read_text(path, kMaxBytes), path);
}

std::vector<OptionInfo> list_options() {
  std::vector<OptionInfo> list;
  LoopDetectorOptions defaults;
  for_each_setting(defaults, [&](std::string_view section, const auto& field, const auto& setting) {
    constexpr bool kIsSwitch = std::is_same_v<std::remove_cvref_t<decltype(setting)>, bool>;
    list.push_back({fmt::format("{}.{}", section, field.name), fmt::format("{}", setting),
                    kIsSwitch ? "true or false" : fmt::format("{} to {}", field.min, field.max),
                    std::string(field.help)});
  });
  return list;
}

}  // namespace loopbit
