// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/world.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

/// The drive as a source of images.
class WorldSource final : public ImageSource {
 public:
  WorldSource(std::shared_ptr<const World> world, std::vector<OdometryPose> odometry)
      : world_(std::move(world)), odometry_(std::move(odometry)) {}

  bool next(Frame& frame) override {
    if (at_end()) return false;
    frame = {fmt::format("{:06}", frame_), World::time_s(frame_), world_->render(frame_), {}};
    if (!odometry_.empty()) {
      const OdometryPose& odometry = odometry_[static_cast<std::size_t>(frame_)];
      frame.T_odometry_camera = odometry.T_odometry_camera;
      frame.odometry_covariance = odometry.covariance;
    }
    ++frame_;
    return true;
  }

  bool skip() override {
    if (at_end()) return false;
    ++frame_;
    return true;
  }

  [[nodiscard]] std::optional<std::size_t> size() const override {
    return static_cast<std::size_t>(world_->options().frames);
  }

  [[nodiscard]] std::string description() const override {
    const WorldOptions& options = world_->options();
    return fmt::format("built-in world, seed {}, {} frames, {} laps of {:.0f} m", options.seed,
                       options.frames, options.laps, world_->circuit_m());
  }

 private:
  [[nodiscard]] bool at_end() const { return frame_ >= world_->options().frames; }

  std::shared_ptr<const World> world_;
  std::vector<OdometryPose> odometry_;
  int frame_ = 0;
};

constexpr std::array kFiles = {"times.txt",   "poses.txt", "odometry.txt",
                               "camera.yaml", "truth.csv", "not_false.csv"};

/// Throws Error (kind output) if the folder has a file that a data set would replace.
void check_no_file_is_lost(const fs::path& folder) {
  for (const char* name : kFiles) {
    std::error_code error;
    if (!fs::exists(folder / name, error)) continue;
    throw Error(ErrorKind::output, fmt::format("'{}' is there already; name another folder for "
                                               "the data set.",
                                               (folder / name).string()));
  }
}

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
std::string kitti_row(const LevelPose& pose) {
  const double c = std::cos(pose.heading_rad);
  const double s = std::sin(pose.heading_rad);
  return fmt::format("{:.9f} 0 {:.9f} {:.6f} 0 1 0 {:.6f} {:.9f} 0 {:.9f} {:.6f}\n", s, c, pose.x_m,
                     0.0 - pose.z_m, -c, s, pose.y_m);
}

/// TUM with covariance. The camera turns about its y axis alone.
std::string odometry_row(double time_s, const OdometryPose& pose) {
  const cv::Matx44d& at = pose.T_odometry_camera;
  const double half_turn = std::atan2(at(0, 2), at(2, 2)) / 2;
  std::string row = fmt::format("{:.6f} {:.6f} {:.6f} {:.6f} 0 {:.9f} 0 {:.9f}", time_s, at(0, 3),
                                at(1, 3), at(2, 3), std::sin(half_turn), std::cos(half_turn));
  const cv::Matx66d covariance = pose.covariance.value_or(cv::Matx66d::zeros());
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) row += fmt::format(" {:.6g}", covariance(i, j));
  }
  return row + '\n';
}

template <typename RowOf>
void write_rows(const fs::path& path, int frames, const RowOf& row_of) {
  std::ofstream file(path);
  for (int frame = 0; frame < frames; ++frame) file << row_of(frame);
  file.close();
  if (!file) throw cannot_write(path.string(), errno);
}

}  // namespace

std::unique_ptr<ImageSource> make_world_source(std::shared_ptr<const World> world,
                                               std::vector<OdometryPose> odometry) {
  return std::make_unique<WorldSource>(std::move(world), std::move(odometry));
}

CameraModel mean_camera(const World& world) {
  const int frames = world.options().frames;
  CameraModel camera = world.camera(0);
  double sum = 0;
  for (int frame = 0; frame < frames; ++frame) sum += world.camera(frame).cy;
  camera.cy = sum / frames;
  return camera;
}

void write_dataset(const World& world, const std::string& folder,
                   const std::function<void(int)>& on_frame) {
  const fs::path root = folder;
  const int frames = world.options().frames;
  check_no_file_is_lost(root);
  make_image_folder(root / "images");
  for (int frame = 0; frame < frames; ++frame) {
    write_image(root / "images" / fmt::format("{:06}.png", frame), world.render(frame));
    on_frame(frame);
  }
  write_rows(root / "times.txt", frames,
             [&](int frame) { return fmt::format("{:.6f}\n", World::time_s(frame)); });
  write_rows(root / "poses.txt", frames, [&](int frame) { return kitti_row(world.pose(frame)); });
  const std::vector<OdometryPose> odometry = drifting_odometry(world);
  write_rows(root / "odometry.txt", frames, [&](int frame) {
    return odometry_row(World::time_s(frame), odometry[static_cast<std::size_t>(frame)]);
  });
  write_file((root / "camera.yaml").string(), to_camera_info(mean_camera(world)));
  write_place_runs(root / "truth.csv", "query, first and last true earlier frame",
                   world.same_place());
  write_place_runs(root / "not_false.csv",
                   "query, first and last earlier frame: a match here is not false",
                   world.near_place());
}

}  // namespace loopbit
