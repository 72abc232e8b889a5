// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What the whole method finds on real images with the default options, as decided. The figures
// are printed, so that a run of the tests shows them.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

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

/// Something that moves with the camera, over the middle of the lowest part of every image.
struct Robot {
  cv::Mat texture;  ///< scaled to cover the part, and cut off at the right or below
  double width = 1;
  double height = 0.25;
};

void attach(const Robot& robot, cv::Mat& image) {
  const cv::Size size(cvRound(image.cols * robot.width),
                      static_cast<int>(image.rows * robot.height));
  const double scale = std::max(static_cast<double>(size.width) / robot.texture.cols,
                                static_cast<double>(size.height) / robot.texture.rows);
  cv::Mat cover;
  cv::resize(robot.texture, cover, {}, scale, scale, cv::INTER_AREA);
  image = gray_image(image).clone();
  const cv::Point corner((image.cols - size.width) / 2, image.rows - size.height);
  cover(cv::Rect({0, 0}, size)).copyTo(image(cv::Rect(corner, size)));
}

/// Something that travels ahead of the camera: it comes nearer, falls back and sways at random.
class Companion {
 public:
  /// Its size on average, in image widths and heights.
  Companion(cv::Mat texture, double width, double height)
      : texture_(std::move(texture)), width_(width), height_(height) {}

  void appear_in(cv::Mat& image) {
    // Each keeps half of its value for some ten frames.
    for (double& state : states_) {
      state = std::clamp(0.93 * state + 0.37 * random_.normal(), -2.5, 2.5);
    }
    const double scale = std::exp(0.15 * states_[0]);
    const cv::Size size(cvRound(image.cols * width_ * scale),
                        cvRound(image.rows * height_ * scale));
    const cv::Point corner(cvRound(image.cols * (0.5 + 0.06 * states_[1])) - size.width / 2,
                           cvRound(image.rows * (0.55 + 0.02 * states_[2])) - size.height / 2);
    image = gray_image(image).clone();
    cv::resize(texture_, image(cv::Rect(corner, size)), size, 0, 0, cv::INTER_AREA);
  }

 private:
  cv::Mat texture_;
  double width_;
  double height_;
  std::array<double, 3> states_{};
  test::Random random_;
};

/// Changes the images of a sequence, one after the other.
using Change = std::function<void(cv::Mat& image)>;

std::vector<Detection> detect_all(const std::string& input, const Change& change = {}) {
  const auto source = open_source((*test::data_dir() / input).string());
  LoopDetector detector;
  std::vector<Detection> detections;
  for (Frame frame; source->next(frame);) {
    EXPECT_EQ(frame.error, "");
    if (change) change(frame.image);
    detections.push_back(detector.process(frame.image, frame.timestamp_s));
  }
  return detections;
}

Change attached(const Robot& robot) {
  return [robot](cv::Mat& image) { attach(robot, image); };
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
                     const Change& change = {}) {
  const DecisionCounts counts = evaluate(match_list(detect_all(input, change)), truth).decision;
  fmt::print("{}: {} of {} revisits found, recall {:.3f}; {} wrong\n", name, counts.right,
             counts.positives, counts.recall(), counts.wrong);
  return counts;
}

GroundTruth corridor_truth() {
  return read_truth("corridor_loop/truth.csv", "corridor_loop/not_false.csv",
                    "corridor_loop/ignore.csv");
}

cv::Mat wall(const std::string& image = "img1") {
  const auto file = *test::data_dir() / "graf" / (image + ".png");
  return cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
}

TEST(RealImages, CorridorWalkedTwice) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  const auto counts = score("corridor_loop", "corridor_loop/images", corridor_truth());
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.97);
}

TEST(RealImages, ACorridorAfterACampusIsNoRevisit) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  LOOPBIT_NEEDS_DATA("gardens_point");
  constexpr int kFirstWalk = 40;
  LoopDetector detector;
  const auto walk = [&](const std::string& images, int most) {
    const auto source = open_source((*test::data_dir() / images).string());
    int loops = 0;
    Frame frame;
    for (int i = 0; i < most && source->next(frame); ++i) {
      if (detector.process(frame.image).status == Status::loop) ++loops;
    }
    return loops;
  };
  EXPECT_EQ(walk("gardens_point/day_left", 200), 0);
  EXPECT_EQ(walk("corridor_loop/images", kFirstWalk), 0)
      << "its walls look more like each other than like the campus";
}

TEST(RealImages, CorridorInFog) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  const auto counts =
      score("corridor_loop, 0.15 of the contrast", "corridor_loop/images", corridor_truth(),
            [](cv::Mat& image) { gray_image(image).convertTo(image, CV_8U, 0.15, 60); });
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.9);
}

TEST(RealImages, ARobotInViewIsNoPlace) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  LOOPBIT_NEEDS_DATA("graf");
  for (const double height : {0.15, 0.2, 0.25}) {
    for (const double width : {0.5, 1.0}) {
      const auto counts =
          score(fmt::format("corridor_loop, robot {} x {}", width, height), "corridor_loop/images",
                corridor_truth(), attached({wall(), width, height}));
      EXPECT_EQ(counts.wrong, 0);
      // The robot takes up to a quarter of the image, and of what can be recognised.
      EXPECT_GE(counts.recall(), 0.84);
    }
  }
}

TEST(RealImages, ARobotFullOfFeaturesIsNoPlace) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  LOOPBIT_NEEDS_DATA("graf");
  cv::Mat squeezed;
  cv::resize(wall(), squeezed, {512, 96}, 0, 0, cv::INTER_AREA);
  const auto counts = score("corridor_loop, full of features", "corridor_loop/images",
                            corridor_truth(), attached({squeezed}));
  EXPECT_EQ(counts.wrong, 0);
  // The texture takes up many of the features.
  EXPECT_GE(counts.recall(), 0.78);
}

// Later frames must not take the first views, of which the robot could not be left out yet, for the
// places where it is.
TEST(RealImages, ARobotInTheFirstViewsIsNoPlace) {
  LOOPBIT_NEEDS_DATA("gardens_point");
  LOOPBIT_NEEDS_DATA("graf");
  const GroundTruth truth = read_truth("gardens_point/truth.csv", "gardens_point/not_false.csv");
  for (const Robot& robot : {Robot{wall("img1"), 1, 0.25}, Robot{wall("img3"), 1, 0.25},
                             Robot{wall("img5"), 0.5, 0.15}}) {
    const auto counts =
        score(fmt::format("left_then_right, robot {} x {}", robot.width, robot.height),
              "gardens_point/left_then_right.txt", truth, attached(robot));
    EXPECT_EQ(counts.wrong, 0);
    EXPECT_GE(counts.recall(), 0.95);
  }
}

TEST(RealImages, ACompanionIsNoPlaceAndHidesNone) {
  LOOPBIT_NEEDS_DATA("gardens_point");
  LOOPBIT_NEEDS_DATA("graf");
  Companion companion(wall(), 0.2, 0.3);
  const auto counts =
      score("left_then_right behind a companion", "gardens_point/left_then_right.txt",
            read_truth("gardens_point/truth.csv", "gardens_point/not_false.csv"),
            [&](cv::Mat& image) { companion.appear_in(image); });
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.85);
}

/// A walk over a campus and then another, from beside or by night.
void expect_campus_recall(const std::string& walks, double min_recall) {
  const auto counts = score(walks, "gardens_point/" + walks + ".txt",
                            read_truth("gardens_point/truth.csv", "gardens_point/not_false.csv"));
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), min_recall);
}

TEST(RealImages, CampusFromBesideAndByNight) {
  LOOPBIT_NEEDS_DATA("gardens_point");
  expect_campus_recall("left_then_right", 0.98);
  expect_campus_recall("right_then_night", 0.78);
  expect_campus_recall("left_then_night", 0.37);
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
  EXPECT_GE(counts.recall(), 0.65);
}

TEST(RealImages, HeadWornCameraHasNoWrongLoop) {
  LOOPBIT_NEEDS_DATA("office_tour");
  const auto counts = score("office_tour", "office_tour/images",
                            read_truth("office_tour/truth.csv", "office_tour/not_false.csv"));
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.recall(), 0.18);
}

TEST(RealImages, LookAlikeDoorsBehindALensRimAreNoLoops) {
  LOOPBIT_NEEDS_DATA("lateral_corridor");
  const auto counts = score("lateral_corridor", "lateral_corridor/images",
                            read_truth("lateral_corridor/truth.csv"));
  // They lie 1 to 3 frames beside the truth, which allows 2.
  EXPECT_LE(counts.wrong, 3);
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
