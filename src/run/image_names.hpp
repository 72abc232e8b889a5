// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace loopbit {

/// The images in a folder by their names without extension. `what` they are, for messages, such as
/// "depth images". Throws Error (kind input) if the folder cannot be read.
std::map<std::string, std::filesystem::path> images_by_stem(const std::string& folder,
                                                            const char* what);

}  // namespace loopbit
