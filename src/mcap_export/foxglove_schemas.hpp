// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace loopbit {

// JSON schemas of messages. Foxglove and Lichtblick know the first two by their names:
// https://docs.foxglove.dev/docs/visualization/message-schemas

/// foxglove.SceneUpdate, with the primitives that mcap_export writes.
std::string scene_schema();

/// foxglove.CompressedImage.
std::string image_schema();

/// loopbit.Detection: a row of loops.csv.
std::string detection_schema();

}  // namespace loopbit
