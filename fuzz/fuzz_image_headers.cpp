// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "encoded_image.hpp"
#include "encoded_video.hpp"
#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)loopbit::images::is_cut_off({data, size});
  (void)loopbit::images::declared_size({data, size});
  loopbit::fuzz::read_as_file(data, size, ".avi", [](const std::string& path) {
    (void)loopbit::images::declared_bytes(path);
  });
  return 0;
}
