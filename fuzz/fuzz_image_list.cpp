// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "fuzz_file.hpp"
#include "sequence_lists.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbit::fuzz::read_as_file(
      data, size, ".csv", [](const std::string& path) { (void)loopbit::images::list_file(path); });
  return 0;
}
