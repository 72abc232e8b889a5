// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>

#include "loopbit/image_source.hpp"

namespace loopbit::images {

/// Throws Error (kind input) if `file` is no video, has no frame, or has larger ones.
std::unique_ptr<ImageSource> open_video(const std::filesystem::path& file, int max_megapixels);

/// `number` from 0 to 99. Throws Error (kind input) if the camera cannot be opened.
std::unique_ptr<ImageSource> open_camera(int number);

}  // namespace loopbit::images
