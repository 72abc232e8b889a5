// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// The pixels of a content that show a companion: something that travels with the robot and moves
/// in the image, such as a car ahead of it, a person or its own arm. `shared` are keypoints of
/// `image` that a much earlier view shows, too. None if they lie in half of the image or more: then
/// the camera is where it was.
BinaryContent companion_pixels(const Features& image, const std::vector<Keypoint>& shared);

}  // namespace loopbit
