// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "commands.hpp"

#include <memory>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/loop_detector_options.hpp"

namespace loopbit::cli {
namespace {

template <typename Number>
CLI::Validator range(Number min, Number max, const char* type, const char* kind) {
  const auto check = [=](const std::string& text) {
    Number value{};
    const bool is_number = CLI::detail::lexical_cast(text, value);
    if (is_number && value >= min && value <= max) return std::string();
    return fmt::format("'{}' is not a {} from {} to {}", text, kind, min, max);
  };
  return {check, fmt::format("{} in [{} - {}]", type, min, max)};
}

}  // namespace

void add_options(CLI::App& app) {
  auto as_json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("options", "List all settings with defaults and ranges");
  command->add_flag("--json", *as_json, "Print the defaults as a settings file for --config");
  command->callback([as_json] {
    if (*as_json) {
      fmt::print("{}\n", to_json(LoopDetectorOptions{}));
      return;
    }
    for (const OptionInfo& option : list_options()) {
      fmt::print("{} = {}    [{}]\n    {}\n", option.name, option.default_value, option.range,
                 option.help);
    }
  });
}

std::pair<std::string, std::string> split_setting(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) {
    throw Error(ErrorKind::option,
                fmt::format("The setting '{}' has no value; write NAME=VALUE.", text));
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

CLI::Validator whole_number(std::int64_t min, std::int64_t max) {
  return range(min, max, "INT", "whole number");
}

CLI::Validator number(double min, double max) { return range(min, max, "FLOAT", "number"); }

}  // namespace loopbit::cli
