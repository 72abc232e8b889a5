// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "sequence_lists.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/text_rows.hpp"

namespace loopbit::images {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::optional<double> parse_nanoseconds(std::string_view text) {
  const auto nanoseconds = parse_number<std::int64_t>(text);
  if (!nanoseconds) return std::nullopt;
  return static_cast<double>(*nanoseconds) / 1e9;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a run of digits or one other character off the front of `text`, which is not empty.
std::string_view take_token(std::string_view& text) {
  std::size_t length = 1;
  if (is_digit(text.front())) {
    length = static_cast<std::size_t>(std::ranges::find_if_not(text, is_digit) - text.begin());
  }
  const std::string_view token = text.substr(0, length);
  text.remove_prefix(length);
  return token;
}

std::string_view without_leading_zeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

/// Negative, zero or positive, as std::string_view::compare.
int compare_tokens(std::string_view a, std::string_view b) {
  if (!is_digit(a.front()) || !is_digit(b.front())) return a.compare(b);
  a = without_leading_zeros(a);
  b = without_leading_zeros(b);
  if (a.size() != b.size()) return a.size() < b.size() ? -1 : 1;
  return a.compare(b);
}

struct Columns {
  std::string_view first;
  std::string_view rest;  ///< empty without a separator
};

Columns split(std::string_view text, std::string_view separators) {
  const std::size_t at = std::min(text.find_first_of(separators), text.size());
  return {trimmed(text.substr(0, at)), trimmed(text.substr(std::min(at + 1, text.size())))};
}

bool is_image_entry(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  return !name.starts_with('.') && is_image_name(name) && !is_folder(entry.path());
}

std::vector<ListedImage> images_in(const fs::path& folder) {
  std::error_code error;
  std::vector<ListedImage> images;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error)) {
    if (is_image_entry(*entry)) images.push_back({entry->path().filename().string(), {}});
  }
  if (error) {
    throw Error(ErrorKind::input, fmt::format("Folder '{}' cannot be read ({}): check its "
                                              "permissions.",
                                              folder.string(), error.message()));
  }
  std::ranges::sort(images, natural_less, &ListedImage::name);
  return images;
}

ImageList list_images(const fs::path& folder, std::string description) {
  ImageList list{folder, std::move(description), images_in(folder)};
  if (!list.images.empty()) return list;
  const fs::path hint = folder / "images";
  throw Error(
      ErrorKind::input,
      fmt::format("Folder '{}' holds no image ({}): {}.", folder.string(), image_extensions(),
                  is_folder(hint) ? fmt::format("give '{}' instead", hint.string())
                                  : "give the folder the images are in"));
}

[[noreturn]] void throw_no_rows(const fs::path& file) {
  throw Error(ErrorKind::input,
              fmt::format("'{}' lists no image: write one image per line.", file.string()));
}

std::vector<double> read_times(const fs::path& file) {
  std::vector<double> times;
  for (const TextRow& row : read_rows(file)) {
    const auto seconds = parse_number<double>(row.text);
    if (!seconds) throw_bad_row(file, row, "one time in seconds");
    times.push_back(*seconds);
  }
  return times;
}

/// 12 of 000012.png.
std::optional<std::size_t> number_of(const std::string& image) {
  return parse_number<std::size_t>(fs::path(image).stem().string());
}

/// `camera`: the folder of images. Their times are in times.txt, if there is one.
ImageList list_timed(const fs::path& folder, std::string_view camera, std::string description) {
  ImageList list = list_images(folder / camera, std::move(description));
  const fs::path file = folder / "times.txt";
  if (!is_file(file)) return list;
  const std::vector<double> times = read_times(file);
  if (times.size() < list.images.size()) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' has {} times for the {} images of {}: complete it, or remove it "
                            "to go without times.",
                            file.string(), times.size(), list.images.size(), camera));
  }
  // Where images are missing, their names still tell the rows of the others.
  const bool is_whole = times.size() == list.images.size();
  for (std::size_t i = 0; i < list.images.size(); ++i) {
    const std::size_t row = is_whole ? i : number_of(list.images[i].name).value_or(i);
    if (row >= times.size()) {
      throw Error(ErrorKind::input,
                  fmt::format("'{}' has {} times, none for image {} of {}: complete it, or remove "
                              "it to go without times.",
                              file.string(), times.size(), list.images[i].name, camera));
    }
    list.images[i].timestamp_s = times[row];
  }
  return list;
}

ImageList list_euroc(const fs::path& camera) {
  const fs::path file = camera / "data.csv";
  std::error_code error;
  const std::string name = fs::canonical(camera, error).filename().string();
  ImageList list{camera / "data", fmt::format("EuRoC sequence, {}", name), {}};
  for (const TextRow& row : read_rows(file)) {
    const auto [time, image] = split(row.text, ",");
    const auto seconds = parse_nanoseconds(time);
    if (!seconds || image.empty() || image.find(',') != std::string_view::npos) {
      throw_bad_row(file, row, "timestamp_ns,filename, its time in whole nanoseconds");
    }
    list.images.push_back({std::string(image), seconds});
  }
  if (list.images.empty()) throw_no_rows(file);
  return list;
}

ImageList list_tum(const fs::path& folder) {
  const fs::path file = folder / "rgb.txt";
  ImageList list{folder, "TUM RGB-D sequence, rgb.txt", {}};
  for (const TextRow& row : read_rows(file)) {
    const auto [time, name] = split(row.text, " \t");
    const auto seconds = parse_number<double>(time);
    if (!seconds || name.empty()) throw_bad_row(file, row, "a timestamp in seconds and a path");
    list.images.push_back({std::string(name), seconds});
  }
  if (list.images.empty()) throw_no_rows(file);
  return list;
}

/// The cam0 folder if `folder` is a EuRoC sequence, its mav0 or its cam0. A data.csv alone does not
/// make one: that name is too common.
std::optional<fs::path> find_euroc_camera(const fs::path& folder) {
  for (const fs::path& camera : {folder / "mav0" / "cam0", folder / "cam0"}) {
    if (is_file(camera / "data.csv")) return camera;
  }
  if (is_file(folder / "data.csv") && is_folder(folder / "data")) return folder;
  return std::nullopt;
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  std::string_view rest_a = a;
  std::string_view rest_b = b;
  while (!rest_a.empty() && !rest_b.empty()) {
    const std::string_view token_a = take_token(rest_a);
    const int order = compare_tokens(token_a, take_token(rest_b));
    if (order != 0) return order < 0;
  }
  if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
  return a < b;
}

ImageList list_folder(const fs::path& folder) {
  for (const std::string_view camera : {"image_0", "image_2"}) {
    if (!is_folder(folder / camera)) continue;
    return list_timed(folder, camera, fmt::format("KITTI odometry sequence, {}", camera));
  }
  if (const auto camera = find_euroc_camera(folder)) return list_euroc(*camera);
  if (is_file(folder / "rgb.txt")) return list_tum(folder);
  if (is_folder(folder / "images") && is_file(folder / "times.txt")) {
    return list_timed(folder, "images", "folder with images and times.txt");
  }
  return list_images(folder, "folder of images");
}

ImageList list_file(const fs::path& file) {
  const bool has_columns = lower_extension(file) == ".csv";
  ImageList list{file.parent_path(), fmt::format("image list {}", file.filename().string()), {}};
  for (const TextRow& row : read_listed_rows(file)) {
    if (!is_image_name(row.text) || (has_columns && row.text.find(',') != std::string::npos)) {
      throw_bad_row(file, row, fmt::format("one image name ({}) and no more", image_extensions()));
    }
    list.images.push_back({row.text, {}});
  }
  if (list.images.empty()) throw_no_rows(file);
  // Data sets often keep a list beside the folder of the images it names. Some may be missing.
  for (const fs::path& root : {list.root, list.root / "images"}) {
    const bool has_any =
        std::any_of(list.images.begin(), list.images.end(),
                    [&](const ListedImage& image) { return is_file(root / image.name); });
    if (!has_any) continue;
    list.root = root;
    break;
  }
  return list;
}

}  // namespace loopbit::images
