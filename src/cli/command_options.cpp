// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <memory>

#include <fmt/format.h>

#include "loopbit/loop_detector_options.hpp"

#include "commands.hpp"

namespace loopbit::cli {

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

}  // namespace loopbit::cli
