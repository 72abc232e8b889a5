// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/world_dataset.hpp"

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

void make_image_folder(const fs::path& images) {
  std::error_code error;
  fs::create_directories(images, error);
  if (error) throw cannot_write(images.string(), error.value());
  if (!fs::is_empty(images, error)) {
    throw Error(ErrorKind::output, fmt::format("'{}' is not empty; name another folder for the "
                                               "images.",
                                               images.string()));
  }
}

void write_image(const fs::path& path, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw cannot_write(path.string(), errno);
}

/// The camera looks along its z axis; the world's x is east, its z north and its y down.
std::string kitti_row(const Pose& pose) {
  const double c = std::cos(pose.heading_rad);
  const double s = std::sin(pose.heading_rad);
  return fmt::format("{:.9f} 0 {:.9f} {:.6f} 0 1 0 0 {:.9f} 0 {:.9f} {:.6f}\n", s, c, pose.x_m, -c,
                     s, pose.y_m);
}

template <typename RowOf>
void write_rows(const fs::path& path, int frames, const RowOf& row_of) {
  std::ofstream file(path);
  for (int frame = 0; frame < frames; ++frame) file << row_of(frame);
  file.close();
  if (!file) throw cannot_write(path.string(), errno);
}

}  // namespace

void write_dataset(const World& world, const std::string& folder,
                   const std::function<void(int)>& on_frame) {
  const fs::path root = folder;
  const int frames = world.options().frames;
  make_image_folder(root / "images");
  for (int frame = 0; frame < frames; ++frame) {
    write_image(root / "images" / fmt::format("{:06}.png", frame), world.render(frame));
    on_frame(frame);
  }
  write_rows(root / "times.txt", frames,
             [&](int frame) { return fmt::format("{:.6f}\n", World::time_s(frame)); });
  write_rows(root / "poses.txt", frames, [&](int frame) { return kitti_row(world.pose(frame)); });
  write_place_runs(root / "truth.csv", "query, first and last true earlier frame",
                   world.same_place());
  write_place_runs(root / "not_false.csv",
                   "query, first and last earlier frame: a match here is not false",
                   world.near_place());
}

}  // namespace loopbit
