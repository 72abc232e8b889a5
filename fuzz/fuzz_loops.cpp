// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/finished_run.hpp"

#include "fuzz_file.hpp"
#include "run_files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbit::fuzz::read_as_file(data, size, ".csv", [](const std::string& path) {
    (void)loopbit::match_list(loopbit::read_detections(path));
  });
  return 0;
}
