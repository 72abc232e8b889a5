// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// MATLAB 5 files alone: those of 7.3 are HDF5, whose library (1.10) is known to crash on damaged
// files; loopbit checks their signature and length and has no more to do with them.
#include <algorithm>
#include <string_view>

#include "loopbit/truth_file.hpp"

#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kHdf5 = "\x89HDF";
  if (std::search(data, data + size, kHdf5.begin(), kHdf5.end(), [](auto a, auto b) {
        return a == static_cast<std::uint8_t>(b);
      }) != data + size) {
    return 0;
  }
  loopbit::fuzz::read_as_file(data, size, ".mat",
                              [](const std::string& path) { (void)loopbit::read_truth(path); });
  return 0;
}
