// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "camera_poses.hpp"
#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbit::fuzz::read_as_file(data, size, ".txt", [](const std::string& path) {
    const auto poses = loopbit::read_poses(path);
    (void)loopbit::truth_from_poses({poses.begin(), poses.end()});
  });
  return 0;
}
