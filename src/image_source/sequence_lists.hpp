// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace loopbit::images {

struct ListedImage {
  std::string name;  ///< path relative to ImageList::root, or absolute
  std::optional<double> timestamp_s;
};

/// What every data set on disk comes down to. Never empty; the images need not exist.
struct ImageList {
  std::filesystem::path root;
  std::string description;
  std::vector<ListedImage> images;
};

/// The sequence in `folder`, whose layout is told by what is in it: see open_source. Throws Error
/// (kind input) if no image is found or a file of the data set is malformed.
ImageList list_folder(const std::filesystem::path& folder);

/// The images that `file`, an image list, names. Throws as list_folder does.
ImageList list_file(const std::filesystem::path& file);

}  // namespace loopbit::images
