// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "loopbit/error.hpp"
#include "loopbit/loop_detector_options.hpp"

// What is accepted is within all ranges, and comes back from its own text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const auto options = loopbit::options_from_json(text, "settings");
    const std::string json = loopbit::to_json(options);
    if (loopbit::to_json(loopbit::options_from_json(json, "settings")) != json) std::abort();
  } catch (const loopbit::Error&) {  // refused, as it should be
  }
  return 0;
}
