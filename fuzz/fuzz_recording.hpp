// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/recordings.hpp"

#include "fuzz_file.hpp"

namespace loopbit::fuzz {

/// Lists the topics of a recording, and reads all images of each.
inline void read_recording(const std::string& path) {
  constexpr int kMegapixels = 1;
  for (const Topic& topic : read_recording_info(path).topics) {
    if (!topic.has_images || topic.messages == 0 || topic.name.empty()) continue;
    const auto source = open_recording(path, topic.name, kMegapixels);
    for (Frame frame; source->next(frame);) {
    }
    (void)source->early_end();
  }
}

}  // namespace loopbit::fuzz
