// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "depth_folder.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/camera_file.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/read_file.hpp"
#include "loopbit/record_run.hpp"
#include "loopbit/text_rows.hpp"
#include "loopbit/world.hpp"
#include "loopbit/write_file.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

const cv::Size kSize_px(16, 12);

class DepthFolderTest : public test::ScratchTest {
 protected:
  /// Of 1, 2, ... metres, at 1000 units per metre.
  void write_depth(const std::string& name, int metres, cv::Size size_px = kSize_px) const {
    const std::filesystem::path file = path(name);
    std::filesystem::create_directories(file.parent_path());
    ASSERT_TRUE(cv::imwrite(file.string(), cv::Mat1w(size_px, static_cast<ushort>(1000 * metres))));
  }

  /// What is wrong with the folder, checked for images of kSize_px.
  [[nodiscard]] std::string fault() const {
    try {
      DepthFolder(path("depth"), 1000).check(kSize_px);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      return error.what();
    }
    return "";
  }
};

double metres(const cv::Mat1f& depth_m) {
  return depth_m.empty() ? 0 : static_cast<double>(depth_m(0, 0));
}

TEST_F(DepthFolderTest, FindsTheImageOfTheSameName) {
  write_depth("depth/000001.png", 1);
  write_depth("depth/000007.tiff", 7);
  const DepthFolder depth(path("depth"), 1000);
  EXPECT_NO_THROW(depth.check(kSize_px));
  EXPECT_NO_THROW(depth.check({640, 480}));  // of the same shape
  EXPECT_NEAR(metres(depth.depth_m("images/000001.jpg", {}, kSize_px)), 1, 1e-5);
  EXPECT_NEAR(metres(depth.depth_m("000007.png", 3.5, kSize_px)), 7, 1e-5);
  EXPECT_TRUE(depth.depth_m("000002.png", {}, kSize_px).empty());
}

TEST_F(DepthFolderTest, FindsTheNearestTimeOfTumRgbd) {
  write_depth("tum/depth/a.png", 1);
  write_depth("tum/depth/b.png", 2);
  write("tum/depth.txt", "# depth maps\n10.000 depth/a.png\n10.030 depth/b.png\n20 depth/no.png\n");
  const DepthFolder depth(path("tum"), 500);
  EXPECT_NEAR(metres(depth.depth_m("rgb/x.png", 10.012, kSize_px)), 2,
              1e-5);  // 1000 units at 500 per m
  EXPECT_NEAR(metres(depth.depth_m("rgb/x.png", 10.017, kSize_px)), 4, 1e-5);
  EXPECT_TRUE(depth.depth_m("rgb/x.png", 10.06, kSize_px).empty());
  EXPECT_TRUE(depth.depth_m("rgb/x.png", {}, kSize_px).empty());
  EXPECT_TRUE(depth.depth_m("rgb/x.png", 20.0, kSize_px).empty());  // the file is missing
}

TEST_F(DepthFolderTest, NamesWhatIsWrong) {
  EXPECT_NE(fault().find("depth' cannot be read"), std::string::npos) << fault();
  std::filesystem::create_directory(path("depth"));
  EXPECT_NE(fault().find("depth' has no depth images"), std::string::npos) << fault();
  write_depth("depth/0.png", 1, {16, 10});
  EXPECT_NE(fault().find("0.png' has 16 x 10 px, but the images have 16 x 12"), std::string::npos)
      << fault();
  cv::imwrite(path("depth/0.png"), cv::Mat1b(kSize_px, 1));
  EXPECT_NE(fault().find("0.png': A depth image has"), std::string::npos) << fault();
  write("depth/0.png", "");
  EXPECT_NE(fault().find("0.png' is empty"), std::string::npos) << fault();
  write("depth/depth.txt", "now depth/0.png\n");
  EXPECT_NE(fault().find("depth.txt"), std::string::npos) << fault();
}

/// Errors of the lengths of relative_poses.csv, as shares of the true ones.
std::vector<double> length_errors(const std::string& file, const World& world) {
  std::vector<double> errors;
  std::vector<std::string_view> cells;
  for (const TextRow& row : read_rows(file)) {
    split_cells(row.text, cells);
    if (cells[3] != "metric") continue;
    const auto number = [&](std::size_t at) { return parse_number<double>(cells[at]).value(); };
    const cv::Vec3d found(number(5), number(6), number(7));
    const cv::Matx44d truth = world.T_world_camera(static_cast<int>(number(1))).inv() *
                              world.T_world_camera(static_cast<int>(number(0)));
    const double length_m = cv::norm(cv::Vec3d(truth(0, 3), truth(1, 3), truth(2, 3)));
    if (length_m > 0.5) errors.push_back(std::abs(cv::norm(found) - length_m) / length_m);
  }
  return errors;
}

/// Numbers between spaces.
std::vector<double> numbers(const std::string& text) {
  std::istringstream stream(text);
  std::vector<double> values;
  for (double value = 0; stream >> value;) values.push_back(value);
  return values;
}

/// A symmetric matrix from the 21 numbers of its upper triangle, the last of `values`.
cv::Matx66d symmetric(const std::vector<double>& values) {
  cv::Matx66d matrix;
  std::size_t at = values.size() - 21;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      matrix(row, column) = matrix(column, row) = values.at(at++);
  }
  return matrix;
}

/// What relative_poses.csv knows of the poses, in the order of its rows.
struct KnownRow {
  bool is_metric;
  std::vector<double> ids;   ///< match, query
  std::vector<double> pose;  ///< position and quaternion
  cv::Matx66d covariance;
};

std::vector<KnownRow> known_rows(const std::string& folder) {
  std::vector<KnownRow> known;
  for (const TextRow& row : read_rows(folder + "/relative_poses.csv")) {
    std::vector<std::string_view> cells;
    split_cells(row.text, cells);
    if (cells[0] == "query" || cells[3] == "nothing") continue;
    std::vector<double> values;
    for (std::size_t at = 5; at < cells.size(); ++at)
      values.push_back(parse_number<double>(cells[at]).value());
    known.push_back(
        {.is_metric = cells[3] == "metric",
         .ids = {parse_number<double>(cells[1]).value(), parse_number<double>(cells[0]).value()},
         .pose = {values.begin(), values.begin() + 7},
         .covariance = symmetric(values)});
  }
  return known;
}

/// The edge of a row: the same pose, and the inverse covariance, of half a rotation vector.
void expect_edge(const std::vector<double>& edge, const KnownRow& row) {
  ASSERT_EQ(edge.size(), 2U + 7 + 21);
  EXPECT_EQ(std::vector<double>(edge.begin(), edge.begin() + 2), row.ids);
  EXPECT_EQ(std::vector<double>(edge.begin() + 2, edge.begin() + 9), row.pose);
  const cv::Matx66d information = symmetric(edge);
  if (!row.is_metric) {
    EXPECT_EQ(cv::norm(information.get_minor<3, 6>(0, 0)), 0);
    return;
  }
  const cv::Matx66d covariance = information.inv(cv::DECOMP_SVD);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double unit = (i >= 3 ? 2 : 1) * (j >= 3 ? 2 : 1);
      const double size = std::sqrt(row.covariance(i, i) * row.covariance(j, j));
      EXPECT_NEAR(unit * covariance(i, j), row.covariance(i, j), 1e-4 * size);
    }
  }
}

/// relative_poses.g2o has the edges of the table, each after its vertices.
void expect_graph(const std::string& folder) {
  const std::vector<KnownRow> known = known_rows(folder);
  std::set<double> vertices;
  std::size_t edges = 0;
  for (const TextRow& row : read_rows(folder + "/relative_poses.g2o")) {
    const std::string text(row.text);
    const std::size_t space = text.find(' ');
    const std::vector<double> values = numbers(text.substr(space));
    if (text.substr(0, space) == "VERTEX_SE3:QUAT") {
      EXPECT_EQ(std::vector<double>(values.begin() + 1, values.end()),
                (std::vector<double>{0, 0, 0, 0, 0, 0, 1}));
      EXPECT_TRUE(vertices.insert(values[0]).second) << text;
      continue;
    }
    ASSERT_EQ(text.substr(0, space), "EDGE_SE3:QUAT");
    ASSERT_LT(edges, known.size());
    EXPECT_TRUE(vertices.contains(values[0]) && vertices.contains(values[1])) << text;
    expect_edge(values, known[edges++]);
  }
  EXPECT_EQ(edges, known.size());
}

/// read_run() reads the poses and the camera that a run wrote.
void expect_read_back(const std::string& folder) {
  const FinishedRun run = read_run(folder);
  const std::vector<KnownRow> known = known_rows(folder);
  std::size_t at = 0;
  for (const LoopPose& loop : run.poses) {
    if (loop.pose.known == PoseKnown::nothing) continue;
    const KnownRow& row = known.at(at++);
    EXPECT_EQ(loop.pose.known == PoseKnown::metric, row.is_metric);
    EXPECT_EQ(loop.match, static_cast<PlaceId>(row.ids[0]));
    EXPECT_EQ(loop.query, static_cast<PlaceId>(row.ids[1]));
    const std::vector<double> pose = numbers(to_tum_pose(loop.pose));
    for (std::size_t i = 0; i < pose.size(); ++i) EXPECT_NEAR(pose[i], row.pose[i], 1e-7);
    EXPECT_EQ(loop.pose.covariance, row.covariance);
    EXPECT_GE(loop.inliers, 15);
  }
  EXPECT_EQ(at, known.size());
  ASSERT_TRUE(run.camera);
  EXPECT_EQ(run.camera->size_px, cv::Size(320, 240));
}

/// The median.
double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double time_s(double frame) { return 1000 + frame / 2; }

/// The images of a source, at the times of time_s().
class TimedImages final : public ImageSource {
 public:
  explicit TimedImages(std::unique_ptr<ImageSource> images) : images_(std::move(images)) {}

  bool next(Frame& frame) override {
    const bool is_there = images_->next(frame);
    frame.timestamp_s = time_s(position_++);
    return is_there;
  }
  bool skip() override {
    ++position_;
    return images_->skip();
  }
  [[nodiscard]] std::optional<std::size_t> size() const override { return images_->size(); }
  [[nodiscard]] std::string description() const override { return images_->description(); }

 private:
  std::unique_ptr<ImageSource> images_;
  int position_ = 0;
};

/// matched_poses.tum has the metric poses of the table, at the times of the queries.
void expect_matched(const std::string& folder) {
  std::vector<std::vector<double>> expected;
  for (const KnownRow& row : known_rows(folder)) {
    if (!row.is_metric) continue;
    expected.push_back({time_s(row.ids[1])});
    expected.back().insert(expected.back().end(), row.pose.begin(), row.pose.end());
  }
  std::vector<std::vector<double>> found;
  for (const TextRow& row : read_rows(folder + "/matched_poses.tum")) {
    if (!row.text.starts_with('#')) found.push_back(numbers(std::string(row.text)));
  }
  EXPECT_EQ(found, expected);
}

/// read_run() says where a rotation is none, of which OpenCV makes no matrix.
void expect_damaged_rotations_are_named(const std::string& folder) {
  constexpr int kQx = 8;
  const std::string file = folder + "/relative_poses.csv";
  std::istringstream whole(read_file(file));
  std::string header;
  std::getline(whole, header);
  std::string damaged = header + '\n';
  for (std::string line; std::getline(whole, line);) {
    std::size_t begin = 0;
    for (int column = 0; column < kQx; ++column) begin = line.find(',', begin) + 1;
    std::size_t end = begin;
    for (int column = 0; column < 4; ++column) end = line.find(',', end) + 1;
    damaged += line.replace(begin, end - begin, "0,0,0,0,") + '\n';
  }
  write_file(file, damaged);
  test::expect_error(ErrorKind::input, {"relative_poses.csv', line", "column 9, reads '0'"},
                     [&] { (void)read_run(folder); });
}

TEST_F(DepthFolderTest, ARunWithDepthMeasuresMetres) {
  WorldOptions options;
  options.frames = 84;
  options.laps = 2;
  options.spacing_m = 2.6;
  options.width_px = 320;
  options.height_px = 240;
  const World world(options);
  write_dataset(world, path("town"));
  std::filesystem::create_directory(path("depth"));
  constexpr double kUnitsPerM = 200;
  for (int frame = 0; frame < options.frames; ++frame) {
    if (frame % 10 == 3) continue;  // some are missing
    cv::Mat stored;
    world.depth_m(frame).convertTo(stored, CV_16U, kUnitsPerM);
    cv::imwrite(path(fmt::format("depth/{:06}.png", frame)), stored);
  }
  const RunRequest request{.folder = path("run"),
                           .evidence = false,
                           .camera = read_camera(path("town/camera.yaml")),
                           .camera_file = "camera.yaml",
                           .depth = path("depth"),
                           .depth_scale = kUnitsPerM};
  RunInput input(std::make_unique<TimedImages>(open_source(path("town/images"))),
                 path("town/images"));
  record_run(input, request, {[](const Detection&) {}, [](const std::string&) {}}, false);
  const std::vector<double> errors = length_errors(path("run/relative_poses.csv"), world);
  ASSERT_GT(errors.size(), 20U);
  EXPECT_LT(middle_of(errors), 0.05);
  expect_graph(path("run"));
  expect_read_back(path("run"));
  expect_matched(path("run"));
  expect_damaged_rotations_are_named(path("run"));
}

class RightImagesTest : public DepthFolderTest {
 protected:
  static constexpr double kBaseline_m = 0.5;

  /// A drive past the same houses twice, with the images of a right camera in "right".
  [[nodiscard]] World drive() const {
    WorldOptions options;
    options.frames = 84;
    options.laps = 2;
    options.spacing_m = 2.6;
    options.width_px = 320;
    options.height_px = 240;
    World world(options);
    write_dataset(world, path("town"));
    std::filesystem::create_directory(path("right"));
    for (int frame = 0; frame < options.frames; ++frame) {
      if (frame % 10 == 3) continue;  // some are missing
      cv::imwrite(path(fmt::format("right/{:06}.jpg", frame)), world.render(frame, kBaseline_m));
    }
    write("right/000014.jpg", "damaged");
    return world;
  }

  /// As Kalibr writes it.
  [[nodiscard]] std::string camchain(const CameraModel& camera, bool has_pose) const {
    const auto entry = [&](int number) {
      return fmt::format(
          "cam{}:\n  camera_model: pinhole\n  intrinsics: [{}, {}, {}, {}]\n"
          "  distortion_model: none\n  resolution: [{}, {}]\n",
          number, camera.fx, camera.fy, camera.cx, camera.cy, camera.size_px.width,
          camera.size_px.height);
    };
    const std::string pose = fmt::format(
        "  T_cn_cnm1: [[1, 0, 0, {}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n", -kBaseline_m);
    return write("camchain.yaml", entry(0) + entry(1) + (has_pose ? pose : ""));
  }

  /// The folder of a run with the right images.
  [[nodiscard]] std::string run(const std::string& name, const std::string& camera_file,
                                double baseline_m) const {
    const RunRequest request{.folder = path(name),
                             .evidence = false,
                             .camera = read_camera(camera_file),
                             .camera_file = camera_file,
                             .right = path("right"),
                             .baseline_m = baseline_m};
    RunInput input(open_source(path("town/images")), path("town/images"));
    record_run(input, request, {[](const Detection&) {}, [](const std::string&) {}}, false);
    return path(name);
  }
};

TEST_F(RightImagesTest, ARunWithAStereoPairMeasuresMetres) {
  const World world = drive();
  const std::string camera_file = path("town/camera.yaml");
  const std::string rectified = run("rectified", camera_file, kBaseline_m);
  const std::vector<double> errors = length_errors(rectified + "/relative_poses.csv", world);
  ASSERT_GT(errors.size(), 20U);
  EXPECT_LT(middle_of(errors), 0.05);
  int missing = 0;
  for (const TextRow& row : read_rows(rectified + "/relative_poses.csv")) {
    missing += std::string_view(row.text).find(",no_depth,") != std::string_view::npos ? 1 : 0;
  }
  EXPECT_GT(missing, 0);
  const std::string chain = run("chain", camchain(read_camera(camera_file), true), 0);
  EXPECT_EQ(read_file(chain + "/relative_poses.csv"), read_file(rectified + "/relative_poses.csv"));
}

TEST_F(RightImagesTest, ARunWithOdometryMeasuresMetres) {
  const World world = drive();
  RunRequest request{.folder = path("run"),
                     .evidence = false,
                     .camera = read_camera(path("town/camera.yaml")),
                     .camera_file = "camera.yaml",
                     .odometry = path("town/poses.txt")};
  RunInput input(open_source(path("town/images")), path("town/images"));
  record_run(input, request, {[](const Detection&) {}, [](const std::string&) {}}, false);
  const std::vector<double> errors = length_errors(path("run/relative_poses.csv"), world);
  ASSERT_GT(errors.size(), 20U);
  EXPECT_LT(middle_of(errors), 0.05);
}

TEST_F(RightImagesTest, ARightCameraThatIsNotKnownIsRefused) {
  cv::imwrite(path("right.png"), cv::Mat1b(480, 640, 7));
  for (const char* name : {"town/images/0.png", "right/0.png"}) {
    std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
    std::filesystem::copy(path("right.png"), path(name));
  }
  const CameraModel camera{.size_px = {640, 480}, .fx = 380, .fy = 380, .cx = 319, .cy = 239};
  const std::string single = write("camera.yaml", to_camera_info(camera));
  test::expect_error(ErrorKind::input, {"right'", "camera.yaml' has one camera"},
                     [&] { (void)run("run", single, 0); });
  const std::string chain = camchain(camera, false);
  test::expect_error(ErrorKind::input, {"right'", "no extrinsics"},
                     [&] { (void)run("run", chain, 0); });
  cv::imwrite(path("right/0.png"), cv::Mat1b(100, 100, 7));
  test::expect_error(ErrorKind::input, {"right'", "640 x 480", "100 x 100"},
                     [&] { (void)run("run", single, 0.1); });
  std::filesystem::remove(path("right/0.png"));
  test::expect_error(ErrorKind::input, {"right' has no images"},
                     [&] { (void)run("run", single, 0.1); });
  EXPECT_FALSE(std::filesystem::exists(path("run")));
}

TEST_F(DepthFolderTest, DepthNeedsACamera) {
  write_depth("images/0.png", 1);
  const RunRequest request{.folder = path("run"), .depth = path("images")};
  RunInput input(open_source(path("images")), path("images"));
  try {
    record_run(input, request, {[](const Detection&) {}, [](const std::string&) {}}, false);
    FAIL() << "depth without a camera was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::option);
    EXPECT_NE(std::string(error.what()).find("need the calibration"), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(path("run")));
}

}  // namespace
}  // namespace loopbit
