// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_output.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "loopbit/write_file.hpp"

#include "process.hpp"

namespace loopbit::cli {

namespace fs = std::filesystem;

void warn_of_damage(const MapReader& map) { warn_of_damage(map.path(), map.damage()); }

void warn_of_damage(const std::string& path, const std::vector<std::string>& damage) {
  if (damage.empty()) return;
  tell(
      fmt::format("loopbit: '{0}' is damaged, and what is damaged was left out ({1}; {2} in all); "
                  "'loopbit map check {0}' lists it.\n",
                  path, damage.front(), damage.size()));
}

PlaceImages::PlaceImages(MapReader& map, const std::string& folder) : map_(map), folder_(folder) {
  make_new_folder(folder);
  map.for_each_place([&](const MapPlace& place) {
    images_[{place.at.session, place.at.frame}].id = place.id;
  });
}

std::string PlaceImages::file_of(const SessionFrame& at) {
  const auto found = images_.find({at.session, at.frame});
  return found == images_.end() ? "" : file_of(at, found->second);
}

const std::string& PlaceImages::file_of(const SessionFrame& at, PlaceImage& image) {
  if (std::exchange(image.is_known, true)) return image.file;
  if (const auto jpeg = map_.image_of({.id = image.id, .at = at})) {
    image.file = (fs::path(folder_) / fmt::format("{}_{:06}.jpg", at.session, at.frame)).string();
    write_file(image.file, {reinterpret_cast<const char*>(jpeg->data()), jpeg->size()});
  }
  return image.file;
}

std::size_t PlaceImages::write_all() {
  std::size_t written = 0;
  for (auto& [at, image] : images_) written += !file_of({at.first, at.second}, image).empty();
  return written;
}

}  // namespace loopbit::cli
