// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "fuzz_recording.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbit::fuzz::read_as_file(data, size, ".db3", loopbit::fuzz::read_recording);
  return 0;
}
