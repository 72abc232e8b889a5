// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/image_source.hpp"

#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/text_rows.hpp"

#include "capture.hpp"
#include "sequence_lists.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCameraPrefix = "camera:";

class ImageListSource final : public ImageSource {
 public:
  ImageListSource(images::ImageList list, int max_megapixels)
      : list_(std::move(list)), max_megapixels_(max_megapixels) {}

  bool next(Frame& frame) override {
    if (position_ == list_.images.size()) return false;
    const images::ListedImage& listed = list_.images[position_++];
    frame = Frame{listed.name, listed.timestamp_s, {}, {}};
    try {
      frame.image = images::read_image_file(list_.root / listed.name, max_megapixels_);
    } catch (const Error& e) {
      frame.error = e.what();
    }
    return true;
  }

  bool skip() override {
    if (position_ == list_.images.size()) return false;
    ++position_;
    return true;
  }

  [[nodiscard]] std::optional<std::size_t> size() const override { return list_.images.size(); }

  [[nodiscard]] std::string description() const override { return list_.description; }

 private:
  images::ImageList list_;
  int max_megapixels_;
  std::size_t position_ = 0;
};

/// OpenCV reads numbers from 100 on as a choice of backend.
int camera_number(std::string_view text) {
  constexpr int kMax = 99;
  const auto number = parse_number<int>(text);
  if (number && *number >= 0 && *number <= kMax) return *number;
  throw Error(ErrorKind::option,
              fmt::format("'{}{}' names no camera: give camera:N with N from 0 to {}, such as "
                          "camera:0.",
                          kCameraPrefix, text, kMax));
}

[[noreturn]] void throw_no_input(const std::string& input, std::string_view reason) {
  throw Error(ErrorKind::input,
              fmt::format("Input '{}' {}: give a folder of images, a .txt or .csv image list, a "
                          "video, or camera:N.",
                          input, reason));
}

fs::file_status status_of(const std::string& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (status.type() == fs::file_type::not_found) throw_no_input(input, "does not exist");
  if (error) throw_no_input(input, fmt::format("cannot be opened ({})", error.message()));
  return status;
}

images::ImageList single_image(const fs::path& file) {
  const std::string name = file.filename().string();
  return {file.parent_path(), fmt::format("image {}", name), {{name, {}}}};
}

bool is_list(const fs::path& file) {
  const std::string extension = images::lower_extension(file);
  return extension == ".txt" || extension == ".csv";
}

std::unique_ptr<ImageSource> open_file(const fs::path& file, int max_megapixels) {
  if (is_list(file)) {
    return std::make_unique<ImageListSource>(images::list_file(file), max_megapixels);
  }
  if (images::is_image_name(file)) {
    return std::make_unique<ImageListSource>(single_image(file), max_megapixels);
  }
  return images::open_video(file, max_megapixels);
}

}  // namespace

std::unique_ptr<ImageSource> open_source(const std::string& input, int max_megapixels) {
  images::check_max_megapixels(max_megapixels);
  if (input.starts_with(kCameraPrefix)) {
    return images::open_camera(camera_number(std::string_view(input).substr(kCameraPrefix.size())));
  }
  const fs::file_status status = status_of(input);
  if (fs::is_directory(status)) {
    return std::make_unique<ImageListSource>(images::list_folder(input), max_megapixels);
  }
  if (fs::is_regular_file(status)) return open_file(input, max_megapixels);
  throw_no_input(input, "is neither a file nor a folder");
}

std::optional<std::size_t> exact_size(const ImageSource& source, const std::string& input) {
  std::error_code error;
  const bool of_images =
      fs::is_directory(input, error) || is_list(input) || images::is_image_name(input);
  return of_images ? source.size() : std::nullopt;
}

}  // namespace loopbit
