// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "commands.hpp"

#include <filesystem>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_server.hpp"

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

namespace fs = std::filesystem;

/// Whether writing `file` would replace `input` or what a command reads in that folder.
bool would_replace(const fs::path& file, const fs::path& input) {
  std::error_code error;
  if (fs::equivalent(file, input, error)) return true;
  if (!fs::is_regular_file(file, error)) return false;
  const std::string name = file.filename().string();
  if (!images::is_image_name(name) && (!is_run_file(name) || name == "report.html")) return false;
  const fs::path folder = fs::absolute(file).parent_path();
  return fs::equivalent(folder, input, error) || fs::equivalent(folder.parent_path(), input, error);
}

}  // namespace

void protect_inputs(const CLI::App& command, const std::vector<std::string>& outputs) {
  for (const std::string& output : outputs) {
    const CLI::Option* written = command.get_option(output);
    if (written->count() == 0) continue;
    const std::string& file = written->results().front();
    for (const CLI::Option* option : command.get_options()) {
      if (option == written) continue;
      for (const std::string& value : option->results()) {
        const std::string path = value.substr(value.find('=') + 1);  // of NAME=PATH
        if (value != file && !would_replace(file, value) && !would_replace(file, path)) continue;
        throw Error(ErrorKind::option,
                    fmt::format("{} '{}' would replace what {} '{}' names; name another file.",
                                output, file, option->get_name(), without_secrets(value)));
      }
    }
  }
}

void refuse_empty_values(CLI::App& app) {
  const auto check = [](const std::string& value) {
    return value.empty() ? std::string("the value is empty; give one, or leave the option out")
                         : std::string();
  };
  for (CLI::Option* option : app.get_options()) {
    if (option->get_items_expected_max() > 0) option->check(CLI::Validator(check, ""));
  }
  for (CLI::App* command : app.get_subcommands({})) refuse_empty_values(*command);
}

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
