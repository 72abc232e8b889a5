// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/truth_file.hpp"

#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbit::fuzz::read_as_file(data, size, ".txt", [](const std::string& path) {
    (void)loopbit::truth_kind(path);
    (void)loopbit::read_truth(path);
  });
  return 0;
}
