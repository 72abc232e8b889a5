// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <string>

#include "loopbit/finished_run.hpp"

#include "commands.hpp"
#include "process.hpp"

namespace loopbit::cli {
namespace {

struct PairsFlags {
  std::string run;
  std::string out;
};

void pairs_command(const PairsFlags& flags) {
  print_or_write(image_pairs(read_run(flags.run).detections), flags.out);
}

}  // namespace

void add_pairs(CLI::App& app) {
  auto flags = std::make_shared<PairsFlags>();
  CLI::App* command =
      app.add_subcommand("pairs", "Print the loops as pairs of images for hloc or COLMAP");
  command->add_option("RUN", flags->run, "A run folder")->required();
  command->add_option("--out", flags->out, "Output file; default: standard output")
      ->type_name("FILE");
  command->callback([command, flags] {
    protect_inputs(*command, {"--out"});
    pairs_command(*flags);
  });
}

}  // namespace loopbit::cli
