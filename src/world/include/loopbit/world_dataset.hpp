// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>

#include "loopbit/world.hpp"

namespace loopbit {

/// Writes the whole drive as a data set: images/000000.png ..., times.txt (seconds), poses.txt
/// (KITTI: camera to world, 3 x 4 numbers per row, x right, y down, z forward), truth.csv and
/// not_false.csv. Calls `on_frame(n)` after each image. Throws Error (kind output) if `folder`
/// already contains images or cannot be written.
void write_dataset(
    const World& world, const std::string& folder,
    const std::function<void(int)>& on_frame = [](int) {});

}  // namespace loopbit
