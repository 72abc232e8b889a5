// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What the whole method finds on real images with the default options, as decided. The figures
// are printed, so that a run of the tests shows them.
#include <memory>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/evaluation.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

/// Something that moves with the camera: a texture over the lowest quarter of the image.
void attach(const cv::Mat& texture, cv::Mat& image) {
  const int height_px = image.rows / 4;
  cv::Mat part;
  cv::resize(texture, part, {image.cols, height_px}, 0, 0, cv::INTER_AREA);
  image = gray_image(image).clone();
  part.copyTo(image.rowRange(image.rows - height_px, image.rows));
}

std::vector<Detection> detect_all(const std::string& input, const cv::Mat& attached = {}) {
  const auto source = open_source((*test::data_dir() / input).string());
  LoopDetector detector;
  std::vector<Detection> detections;
  for (Frame frame; source->next(frame);) {
    EXPECT_EQ(frame.error, "");
    if (!attached.empty()) attach(attached, frame.image);
    detections.push_back(detector.process(frame.image, frame.timestamp_s));
  }
  return detections;
}

GroundTruth read_truth(const std::string& truth, const std::string& not_false = "",
                       const std::string& ignore = "") {
  const auto file = [](const std::string& name) { return (*test::data_dir() / name).string(); };
  GroundTruth read;
  read.same_place = read_place_runs(file(truth));
  if (!not_false.empty()) read.near_place = read_place_runs(file(not_false));
  if (!ignore.empty()) read.ignored = read_frame_list(file(ignore));
  return read;
}

DecisionCounts score(const std::string& name, const std::string& input, const GroundTruth& truth,
                     const cv::Mat& attached = {}) {
  const DecisionCounts counts = evaluate(match_list(detect_all(input, attached)), truth).decision;
  fmt::print("{}: {} of {} revisits found, recall {:.3f}; {} wrong\n", name, counts.right,
             counts.positives, counts.recall(), counts.wrong);
  return counts;
}

TEST(RealImages, CorridorWalkedTwice) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  const auto counts = score("corridor_loop", "corridor_loop/images",
                            read_truth("corridor_loop/truth.csv", "corridor_loop/not_false.csv",
                                       "corridor_loop/ignore.csv"));
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.90);
}

TEST(RealImages, ARobotInViewIsNoPlace) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  LOOPBIT_NEEDS_DATA("graf");
  const cv::Mat texture =
      cv::imread((*test::data_dir() / "graf/img1.png").string(), cv::IMREAD_GRAYSCALE);
  ASSERT_FALSE(texture.empty());
  const auto counts = score("corridor_loop with a robot in view", "corridor_loop/images",
                            read_truth("corridor_loop/truth.csv", "corridor_loop/not_false.csv",
                                       "corridor_loop/ignore.csv"),
                            texture);
  EXPECT_EQ(counts.wrong, 0);
  // The texture takes up many of the features.
  EXPECT_GE(counts.recall(), 0.80);
}

TEST(RealImages, DriveWithoutRevisitHasNoLoop) {
  LOOPBIT_NEEDS_DATA("kitti03");
  const auto counts = score("kitti03", "kitti03/images", {});
  EXPECT_EQ(counts.wrong, 0);
}

TEST(RealImages, ArtificialSecondPassOfADrive) {
  LOOPBIT_NEEDS_DATA("kitti03");
  const auto counts = score("kitti03 two pass (artificial)", "kitti03/two_pass_order.txt",
                            read_truth("kitti03/two_pass_truth.csv"));
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.98);
}

TEST(RealImages, DroneInOneRoomHasNoWrongLoop) {
  LOOPBIT_NEEDS_DATA("euroc_room");
  const auto counts = score("euroc_room", "euroc_room/images",
                            read_truth("euroc_room/truth.csv", "euroc_room/not_false.csv"));
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.40);
}

TEST(RealImages, HeadWornCameraHasNoWrongLoop) {
  LOOPBIT_NEEDS_DATA("office_tour");
  const auto counts = score("office_tour", "office_tour/images",
                            read_truth("office_tour/truth.csv", "office_tour/not_false.csv"));
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.10);
}

TEST(RealImages, LookAlikeDoorsBehindALensRimAreNoLoops) {
  LOOPBIT_NEEDS_DATA("lateral_corridor");
  const auto counts = score("lateral_corridor", "lateral_corridor/images",
                            read_truth("lateral_corridor/truth.csv"));
  EXPECT_EQ(counts.wrong, 0);
}

TEST(RealImages, StandingStillIsNoRevisit) {
  LOOPBIT_NEEDS_DATA("office_tour");
  const auto source = open_source((*test::data_dir() / "office_tour/images").string());
  LoopDetector detector;
  Frame frame;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(source->next(frame));
    detector.process(frame.image);
  }
  test::Random random;
  const cv::Mat1b view = frame.image.clone();
  for (int i = 0; i < 60; ++i) {
    EXPECT_NE(detector.process(test::with_noise(view, 3.0, random)).status, Status::loop) << i;
  }
}

}  // namespace
}  // namespace loopbit
