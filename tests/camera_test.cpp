// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/camera.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/persistence.hpp>

#include "loopbit/camera_file.hpp"
#include "loopbit/write_file.hpp"

#include "test_cameras.hpp"
#include "test_support.hpp"

namespace loopbit {

std::ostream& operator<<(std::ostream& stream, const CameraModel& camera) {
  return stream << to_camera_info(camera);
}

namespace test {
namespace {

/// A wide lens of OpenCV's rational model.
CameraModel rational() {
  return {.lens = Lens::radial_tangential,
          .size_px = {1280, 720},
          .fx = 610,
          .fy = 612,
          .cx = 640,
          .cy = 355,
          .distortion = {-0.05, 0.01, 0.0004, -0.0006, 0.001, 0.05, 0.005, 0.0005}};
}

std::vector<CameraModel> cameras() { return {pinhole(), euroc(), rational(), fisheye()}; }

/// Pixels all over the image.
std::vector<cv::Vec2d> pixels_of(const CameraModel& camera) {
  std::vector<cv::Vec2d> pixels;
  for (int y = 2; y < camera.size_px.height; y += 29) {
    for (int x = 3; x < camera.size_px.width; x += 37) pixels.emplace_back(x, y);
  }
  return pixels;
}

TEST(Camera, UnprojectsWhatItProjects) {
  for (const CameraModel& camera : cameras()) {
    for (const cv::Vec2d& pixel : pixels_of(camera)) {
      const auto direction = unproject(camera, pixel);
      ASSERT_TRUE(direction) << camera << pixel;
      EXPECT_NEAR(cv::norm(*direction), 1, 1e-12);
      const auto back = project(camera, *direction * 7.0);
      ASSERT_TRUE(back) << camera << pixel;
      EXPECT_LT(cv::norm(*back - pixel), 1e-6) << camera << pixel;
    }
  }
}

TEST(Camera, JacobiansAreTheNumericDifferences) {
  constexpr double kStep = 1e-6;
  for (const CameraModel& camera : cameras()) {
    for (const cv::Vec2d& pixel : pixels_of(camera)) {
      cv::Matx32d by_pixel;
      const auto direction = unproject(camera, pixel, &by_pixel);
      ASSERT_TRUE(direction);
      for (int i = 0; i < 2; ++i) {
        cv::Vec2d step;
        step[i] = kStep * camera.fx;
        const cv::Vec3d slope =
            (*unproject(camera, pixel + step) - *unproject(camera, pixel - step)) * (0.5 / step[i]);
        for (int row = 0; row < 3; ++row)
          EXPECT_NEAR(by_pixel(row, i) * camera.fx, slope[row] * camera.fx, 1e-5);
      }
      const cv::Vec3d point = *direction * 3.0;
      cv::Matx23d by_point;
      ASSERT_TRUE(project(camera, point, &by_point));
      for (int i = 0; i < 3; ++i) {
        cv::Vec3d step;
        step[i] = kStep;
        const cv::Vec2d slope =
            (*project(camera, point + step) - *project(camera, point - step)) * (0.5 / kStep);
        for (int row = 0; row < 2; ++row) {
          EXPECT_NEAR(by_point(row, i), slope[row], 1e-4 * camera.fx) << camera << pixel;
        }
      }
    }
  }
}

cv::Matx33d matrix_of(const CameraModel& camera) {
  return {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
}

TEST(Camera, ProjectsAsOpenCvDoes) {
  const std::vector<cv::Point3d> points{
      {0.1, -0.2, 1}, {-0.7, 0.3, 1.5}, {0, 0, 2}, {0.4, 0.5, 1.1}};
  for (const CameraModel& camera : cameras()) {
    std::vector<cv::Point2d> expected;
    if (camera.lens == Lens::equidistant) {
      const std::vector<double> k(camera.distortion.begin(), camera.distortion.begin() + 4);
      cv::fisheye::projectPoints(points, expected, cv::Vec3d(), cv::Vec3d(), matrix_of(camera), k);
    } else {
      const std::vector<double> k(camera.distortion.begin(), camera.distortion.end());
      cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix_of(camera), k, expected);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto pixel = project(camera, cv::Vec3d(points[i].x, points[i].y, points[i].z));
      ASSERT_TRUE(pixel);
      EXPECT_LT(cv::norm(*pixel - cv::Vec2d(expected[i].x, expected[i].y)), 1e-9) << camera;
    }
  }
}

TEST(Camera, FisheyeSeesBehindItself) {
  CameraModel camera = fisheye();
  camera.distortion = {};
  const cv::Vec3d behind(1, 0.2, -0.3);
  const auto pixel = project(camera, behind);
  ASSERT_TRUE(pixel);
  const auto direction = unproject(camera, *pixel);
  ASSERT_TRUE(direction);
  EXPECT_LT(cv::norm(*direction - cv::normalize(behind)), 1e-9);
  EXPECT_FALSE(project(pinhole(), behind));
  EXPECT_FALSE(project(camera, {0, 0, -1}));
}

TEST(Camera, HasNoRayWhereTheDistortionTurnsBack) {
  CameraModel camera = euroc();
  camera.distortion[1] = 0;  // k1 alone turns back at 1.08 focal lengths
  EXPECT_FALSE(project(camera, {1.5, 0, 1}));
  EXPECT_TRUE(project(camera, {0.9, 0, 1}));
  EXPECT_FALSE(unproject(camera, {camera.cx + camera.fx, camera.cy}));
}

TEST(Camera, ResizedSeesTheSameDirections) {
  const CameraModel half = resized(euroc(), {376, 240});
  const cv::Vec2d pixel(100, 77);
  const auto direction = unproject(half, pixel);
  const auto expected = unproject(euroc(), {200.5, 154.5});
  ASSERT_TRUE(direction && expected);
  EXPECT_LT(cv::norm(*direction - *expected), 1e-9);
}

TEST(Camera, BadNumbersAreErrors) {
  CameraModel camera = euroc();
  camera.distortion[2] = std::numeric_limits<double>::quiet_NaN();
  expect_error(ErrorKind::input, {"left", "nan"}, [&] { validate(camera, "left"); });
  camera = pinhole();
  camera.fy = 0;
  expect_error(ErrorKind::input, {"left", "0 px", "positive"}, [&] { validate(camera, "left"); });
  camera = pinhole();
  camera.cx = 700;
  expect_error(ErrorKind::input, {"700", "640 x 480"}, [&] { validate(camera, "left"); });
}

TEST(Camera, AnotherImageSizeIsAnError) {
  check_size(pinhole(), "left", {640, 480});
  expect_error(ErrorKind::input, {"left", "640 x 480", "320 x 240"}, [] {
    check_size(pinhole(), "left", {320, 240});
  });
  CameraModel camera = pinhole();
  camera.size_px = {};
  check_size(camera, "left", {700, 500});
  expect_error(ErrorKind::input, {"(315, 242)", "200 x 100"}, [&] {
    check_size(camera, "left", {200, 100});
  });
}

/// A folder of its own for each test, removed at its end.
class CameraFile : public testing::Test {
 protected:
  CameraFile() { std::filesystem::create_directories(folder_); }
  ~CameraFile() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    const auto path = folder_ / name;
    std::filesystem::create_directories(path.parent_path());
    write_file(path.string(), text);
    return path.string();
  }

  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) /
                                  testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(CameraFile, ReadsWhatItWrites) {
  for (const CameraModel& camera : cameras()) {
    EXPECT_EQ(read_camera(write("camera.yaml", to_camera_info(camera))), camera);
  }
}

TEST_F(CameraFile, ReadsEuroc) {
  const std::string path = write("sensor.yaml", R"(%YAML:1.0
# General sensor definitions.
T_BS:
  cols: 4
  rows: 4
  data: [0, -1, 0, -0.02,
         1, 0, 0, -0.06,
         0, 0, 1, 0.01,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
)");
  CameraModel expected = euroc();
  expected.T_body_camera = cv::Matx44d(0, -1, 0, -0.02, 1, 0, 0, -0.06, 0, 0, 1, 0.01, 0, 0, 0, 1);
  EXPECT_EQ(read_camera(path), expected);
}

TEST_F(CameraFile, ReadsAChainOfKalibr) {
  const std::string path = write("camchain.yaml", R"(cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.012, 0.004, -0.0021, 0.0003]
  distortion_model: equidistant
  intrinsics: [240, 241, 322, 238]
  resolution: [640, 480]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [500, 510, 315, 242]
  resolution: [640, 480]
)");
  const auto chain = read_cameras(path);
  ASSERT_EQ(chain.size(), 2U);
  CameraModel first = fisheye();
  first.T_body_camera = cv::Matx44d::eye();
  EXPECT_EQ(chain[0], first);
  EXPECT_EQ(chain[1].lens, Lens::pinhole);
  ASSERT_TRUE(chain[1].T_body_camera);
  EXPECT_NEAR((*chain[1].T_body_camera)(0, 3), 0.11, 1e-12);
  expect_error(ErrorKind::input, {"2 cameras", "number 2"}, [&] { read_camera(path, 2); });
}

TEST_F(CameraFile, ReadsMessagesOfRos) {
  const std::string path = write("info.yaml", R"(height: 480
width: 640
distortion_model: plumb_bob
d: [0.1, -0.2, 0.001, 0.002, 0.05]
k: [500.0, 0.0, 315.0, 0.0, 510.0, 242.0, 0.0, 0.0, 1.0]
---
)");
  CameraModel expected = pinhole();
  expected.lens = Lens::radial_tangential;
  expected.distortion = {0.1, -0.2, 0.001, 0.002, 0.05};
  EXPECT_EQ(read_camera(path), expected);
}

TEST_F(CameraFile, ReadsWhatOpenCvWrites) {
  for (const CameraModel& camera : {rational(), fisheye()}) {
    const std::string path = (folder_ / "opencv.yml").string();
    const bool is_fisheye = camera.lens == Lens::equidistant;
    cv::FileStorage file(path, cv::FileStorage::WRITE);
    file << "image_width" << camera.size_px.width << "image_height" << camera.size_px.height;
    file << "fisheye_model" << static_cast<int>(is_fisheye);
    file << "camera_matrix" << cv::Mat(matrix_of(camera));
    file << "distortion_coefficients"
         << cv::Mat(1, is_fisheye ? 4 : 8, CV_64F, const_cast<double*>(camera.distortion.data()));
    file.release();
    EXPECT_EQ(read_camera(path), camera);
  }
}

TEST_F(CameraFile, ReadsKitti) {
  const std::string path = write("calib.txt",
                                 "P0: 718.856 0 607.1928 0 0 718.856 185.2157 0 0 0 1 0\n"
                                 "P1: 718.856 0 607.1928 -386.1448 0 718.856 185.2157 0 0 0 1 0\n"
                                 "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto cameras = read_cameras(path);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].fx, 718.856);
  EXPECT_EQ(cameras[0].cy, 185.2157);
  EXPECT_TRUE(cameras[0].size_px.empty());
  EXPECT_NEAR((*cameras[1].T_body_camera)(0, 3), 0.5372, 1e-4);
}

TEST_F(CameraFile, ReadsAMatrixAlone) {
  const CameraModel camera = read_camera(write("intrinsics.txt", "500 0 315\n0 510 242\n0 0 1\n"));
  EXPECT_EQ(camera.fx, 500);
  EXPECT_EQ(camera.fy, 510);
  EXPECT_EQ(camera.cx, 315);
  EXPECT_EQ(camera.cy, 242);
}

TEST_F(CameraFile, WhatItCannotReadIsAnError) {
  const auto expect_bad = [&](const std::string& text, std::string_view part) {
    const std::string path = write("camera.yaml", text);
    expect_error(ErrorKind::input, {path, part}, [&] { read_cameras(path); });
  };
  expect_bad("frames: 3\n", "has no camera");
  expect_bad("[1, 2\n", "is not valid YAML");
  expect_bad(std::string(100, '['), "brackets");
  std::string deep;
  for (int i = 0; i < 20'000; ++i) deep += "- ";
  expect_bad(deep, "is not valid YAML");
  expect_bad("intrinsics: [1, 2, 3, 4]\ncamera_model: omni\n", "'omni'");
  expect_bad("intrinsics: [1, 2]\nresolution: [3, 4]\ncamera_model: pinhole\n", "4 intrinsics");
  expect_bad("camera_matrix: [1, 2, 3]\n", "3 numbers");
  expect_bad("camera_matrix: &a [*a, *a]\n", "a finite number is needed");
  expect_bad("row: &r [1, 2, 3, 4, 5, 6, 7, 8, 9]\nk: [*r, *r, *r, *r, *r, *r, *r, *r]\n",
             "too many numbers");
  expect_bad("camera_matrix: {data: [1, 0, .nan, 0, 1, 0, 0, 0, 1]}\n", "'.nan'");
  const std::string matrix = "k: [9, 0, 1, 0, 9, 1, 0, 0, 1]\n";
  expect_bad(matrix + "d: [0, 0, 0, 0, nan]\n", "'nan'");
  expect_bad(matrix + "d: [1, 2, 3]\n", "3 distortion coefficients");
  expect_bad(matrix + "d: [1, 0, 0, 0, 0, 0, 0, 0, 1]\n", "the first 8");
  expect_bad(matrix + "d: [1, 0, 0, 0]\ndistortion_model: thin_prism\n", "'thin_prism'");
  expect_bad("k: [0, 0, 1, 0, 9, 1, 0, 0, 1]\n", "must be positive");
}

TEST_F(CameraFile, IsFoundInADataSet) {
  EXPECT_FALSE(find_camera(folder_.string()));
  const std::string euroc_file = write("euroc/mav0/cam0/sensor.yaml", "");
  EXPECT_EQ(find_camera((folder_ / "euroc").string()), (FoundCamera{euroc_file, 0}));
  const std::string kitti_file = write("kitti/calib.txt", "");
  EXPECT_EQ(find_camera((folder_ / "kitti").string()), (FoundCamera{kitti_file, 2}));
  std::filesystem::create_directories(folder_ / "kitti" / "image_0");
  EXPECT_EQ(find_camera((folder_ / "kitti").string()), (FoundCamera{kitti_file, 0}));
  EXPECT_EQ(find_camera((folder_ / "kitti/image_1").string()), (FoundCamera{kitti_file, 1}));
  EXPECT_EQ(find_camera((folder_ / "kitti/image_3/").string()), (FoundCamera{kitti_file, 3}));
  EXPECT_FALSE(find_camera((folder_ / "kitti/image_4").string()));
  const std::string right_file = write("euroc/mav0/cam1/sensor.yaml", "");
  EXPECT_EQ(find_camera((folder_ / "euroc/mav0/cam1/data").string()), (FoundCamera{right_file, 0}));
  EXPECT_FALSE(find_camera((folder_ / "euroc/mav0/cam1/images").string()));
}

}  // namespace
}  // namespace test
}  // namespace loopbit
