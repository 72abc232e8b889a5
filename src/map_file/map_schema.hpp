// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/database.hpp"

namespace loopbit {

/// "loop" in ASCII: what file(1) and SQLite tell a map by.
inline constexpr int kMapApplicationId = 0x6c6f6f70;

/// The version of the format that this library writes. It reads all before, too.
inline constexpr int kMapVersion = 2;
inline constexpr int kFirstVersionWithImages = 2;

/// Large pages: features take 48 KB a place, contents are read one after the other.
inline constexpr int kMapPageBytes = 16384;

/// Opens a map to be written, made if there is none or an empty file, and brought to kMapVersion.
/// What is committed survives the loss of power. Throws Error (kind input) if the file is no map,
/// of a newer version or damaged where its tables are listed, (kind output) if it cannot be
/// written. `version`: of a map that is made, to repair an older one by.
Database open_map_for_writing(const std::string& path, int version = kMapVersion);

/// Whether the map's version has a table of images.
bool has_images(const Database& database);

/// Leaves one file without a log beside it. False if others have the map open: the log remains, and
/// is part of the map.
bool close_log(const Database& database);

/// Opens a map to be read, beside a writer or without. Throws as above, kind input.
Database open_map_for_reading(const std::string& path);

/// Whether the map is of a newer version; not if its first page is damaged. Throws Error (kind
/// input) if there is no file, it may not be read or another program holds it.
bool is_newer_map(const std::string& path);

}  // namespace loopbit
