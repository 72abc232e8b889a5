// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "run_graph.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "loopbit/g2o_file.hpp"

#include "run_folder.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

/// A drive of 10 m ahead and 10 m back, sideways, in steps of 1 m. Its odometry goes 5 % too far.
class RunGraphTest : public test::ScratchTest {
 protected:
  static constexpr int kFrames = 21;
  static constexpr double kScale = 1.05;

  void SetUp() override {
    ScratchTest::SetUp();
    drift_.position_per_m = 0.1;
    for (int frame = 0; frame < kFrames; ++frame) {
      Detection detection{.frame = frame, .timestamp_s = frame / 10.0};
      OdometryPose odometry;
      odometry.T_odometry_camera(0, 3) = 100 + kScale * true_x(frame);
      odometry.T_odometry_camera(2, 3) = (kScale - 1) * frame;
      detection.odometry = odometry;
      detections_.push_back(detection);
    }
  }

  static double true_x(int frame) { return frame <= 10 ? frame : 20 - frame; }

  /// A loop at once, whose pose is known to be where odometry would put it, but for `off_m`.
  void add_loop(int query, int match, double off_m = 0) {
    Detection& detection = detections_[static_cast<std::size_t>(query)];
    detection.status = Status::loop;
    detection.match = match;
    detection.similarity = 0.5;
    LoopPose loop{.query = query, .match = match};
    loop.pose.known = PoseKnown::metric;
    loop.pose.T_match_query(0, 3) = true_x(query) - true_x(match) + off_m;
    loop.pose.covariance = cv::Matx66d::diag({1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6});
    poses_.push_back(loop);
  }

  [[nodiscard]] RunGraph graph() const { return {detections_, poses_, drift_}; }

  [[nodiscard]] std::vector<std::optional<cv::Vec3d>> truth() const {
    std::vector<std::optional<cv::Vec3d>> truth;
    for (int frame = 0; frame < kFrames; ++frame)
      truth.emplace_back(cv::Vec3d(true_x(frame), 0, 0));
    return truth;
  }

  OdometryDrift drift_;
  std::vector<Detection> detections_;
  std::vector<LoopPose> poses_;
};

TEST_F(RunGraphTest, CorrectsTheTrajectoryAndRejectsALoop) {
  for (int frame = 15; frame < kFrames; ++frame) add_loop(frame, 20 - frame);
  add_loop(13, 7, 20);
  const RunGraph graph = this->graph();
  const std::vector<LateLoop> rejected = graph.rejected();
  ASSERT_EQ(rejected.size(), 1U);
  EXPECT_EQ(rejected[0].frame, 13);
  EXPECT_EQ(rejected[0].match, 7);
  EXPECT_EQ(rejected[0].score, 0);
  EXPECT_EQ(rejected[0].similarity, 0.5);
  const Correction results = graph.results(truth());
  EXPECT_EQ(results.keyframes, kFrames);
  EXPECT_EQ(results.kept(), 6);
  EXPECT_EQ(results.rejected(), 1);
  EXPECT_EQ(results.unjudged, 0);
  EXPECT_LT(results.corrected_error_m.value(), results.odometry_error_m.value() * 0.8);
  EXPECT_FALSE(graph.results({}).corrected_error_m) << "the truth is not known";
}

TEST_F(RunGraphTest, TakesTheLoopsThatAreLeftInTheEnd) {
  add_loop(18, 2);
  add_loop(19, 1);
  detections_[20].withdrawn_loops = {{.frame = 18, .match = 2}};
  detections_[20].late_loops = {{.frame = 17, .match = 3, .score = 0.99},
                                {.frame = 16, .earlier_match = SessionFrame{1, 4}, .score = 0.99}};
  graph().write(path(""));
  const auto rows = test::lines_of(path("judged_loops.csv"));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0], kJudgedLoopsHeader);
  EXPECT_EQ(rows[1].substr(0, 18), "17,3,kept,nothing,") << "it has no pose";
  EXPECT_EQ(rows[2].substr(0, 17), "19,1,kept,metric,");
}

TEST_F(RunGraphTest, KeyframesAreTheFramesWithOdometry) {
  detections_[4].odometry.reset();
  add_loop(16, 4);
  add_loop(18, 2);
  const RunGraph graph = this->graph();
  EXPECT_EQ(graph.results({}).unjudged, 1);
  EXPECT_EQ(graph.results({}).keyframes, kFrames - 1);
  graph.write(path(""));
  const auto rows = test::lines_of(path("trajectory.csv"));
  ASSERT_EQ(rows.size(), std::size_t{kFrames});
  EXPECT_EQ(rows[0], kTrajectoryHeader);
  EXPECT_EQ(rows[1], "0,0,100.0000,0.0000,0.0000,100.0000,0.0000,0.0000")
      << "both begin where odometry does";
  EXPECT_EQ(rows[5].substr(0, 24), "5,4,105.2500,0.0000,0.25");
  const LoopGraph written = read_g2o(path("graph.g2o"));
  EXPECT_EQ(written.size(), kFrames - 1);
  ASSERT_EQ(written.loops().size(), 1U);
  EXPECT_EQ(written.loops()[0].edge.query, 17) << "of frame 18";
  EXPECT_NEAR(written.odometry(4)->T_from_to(0, 3), 2 * kScale, 1e-9) << "over the frame without";
  EXPECT_EQ(test::lines_of(path("corrected.tum")).size(), std::size_t{kFrames});
  EXPECT_FALSE(std::filesystem::exists(path("corrected.kitti"))) << "it has a row for each frame";
}

TEST_F(RunGraphTest, CovariancesOfTheOdometryCount) {
  add_loop(20, 0);
  detections_[10].odometry->covariance = cv::Matx66d::diag({4, 4, 4, 1e-4, 1e-4, 1e-4});
  graph().write(path(""));
  const LoopGraph written = read_g2o(path("graph.g2o"));
  EXPECT_NEAR(written.odometry(10)->covariance(0, 0), 4, 1e-9);
  EXPECT_NEAR(written.odometry(9)->covariance(0, 0),
              drift_covariance(written.odometry(9)->T_from_to, drift_)(0, 0), 1e-9);
}

TEST_F(RunGraphTest, AllFramesWithOdometryGiveKittiRows) {
  graph().write(path(""));
  const auto rows = test::lines_of(path("corrected.kitti"));
  ASSERT_EQ(rows.size(), std::size_t{kFrames});
  EXPECT_EQ(rows[0], "1 0 0 100 0 1 0 0 0 0 1 0");
  EXPECT_EQ(test::lines_of(path("corrected.tum"))[2].substr(0, 17), "0.100000 101.05 0");
}

TEST_F(RunGraphTest, IsReadWithItsRun) {
  for (int frame = 15; frame < kFrames; ++frame) add_loop(frame, 20 - frame);
  add_loop(13, 7, 20);
  RunFolder folder(path("run"), false);
  for (const Detection& detection : detections_) folder.add(detection);
  EXPECT_TRUE(read_run(path("run")).trajectory.empty());
  graph().write(path("run"));
  const FinishedRun run = read_run(path("run"));
  ASSERT_EQ(run.trajectory.size(), std::size_t{kFrames});
  EXPECT_EQ(run.trajectory[20].frame, 20);
  EXPECT_EQ(run.trajectory[20].odometry_m, cv::Vec3d(100, 0, 1));
  EXPECT_LT(cv::norm(run.trajectory[20].corrected_m - cv::Vec3d(100, 0, 0)), 0.1);
  ASSERT_EQ(run.judged_loops.size(), 7U);
  EXPECT_EQ(run.judged_loops[0].query, 13);
  EXPECT_EQ(run.judged_loops[0].match, 7);
  EXPECT_NE(run.judged_loops[0].verdict, LoopVerdict::kept);
  EXPECT_EQ(run.judged_loops[6].verdict, LoopVerdict::kept);
  (void)write("run/judged_loops.csv", std::string(kJudgedLoopsHeader) + "\n3,1,fine,,0,0,0,0,0\n");
  test::expect_error(ErrorKind::input, {"judged_loops.csv", "line 2", "'fine'"},
                     [&] { (void)read_run(path("run")); });
}

TEST_F(RunGraphTest, OdometryIsNotDoubtedWithoutReason) {
  EXPECT_EQ(odometry_doubt(detections_, {}), "");
  for (int frame = 11; frame < kFrames; ++frame) add_loop(frame, 20 - frame);
  EXPECT_EQ(odometry_doubt(detections_, graph().results({})), "");
  for (Detection& detection : detections_) detection.odometry.reset();
  EXPECT_EQ(odometry_doubt(detections_, {}), "");
}

TEST_F(RunGraphTest, ManyRejectedLoopsAreADoubt) {
  for (int frame = 11; frame < kFrames; ++frame) add_loop(frame, 20 - frame, 50);
  const std::string doubt = odometry_doubt(detections_, graph().results({}));
  EXPECT_NE(doubt.find("the pose graph rejects 10 of 10 loops"), std::string::npos) << doubt;
  EXPECT_EQ(odometry_doubt(detections_, {}), "");
}

TEST_F(RunGraphTest, AJumpIsADoubtUnlessALoopJoinsItsSides) {
  for (int frame = 12; frame < kFrames; ++frame) {
    detections_[static_cast<std::size_t>(frame)].odometry->T_odometry_camera(1, 3) = -30;
  }
  const std::string doubt = odometry_doubt(detections_, {});
  EXPECT_NE(doubt.find("it jumps by 30.0 m from frame 11 to frame 12"), std::string::npos) << doubt;
  add_loop(18, 13);
  EXPECT_NE(odometry_doubt(detections_, {}), "") << "both after it";
  add_loop(19, 1);
  EXPECT_EQ(odometry_doubt(detections_, {}), "");
}

TEST_F(RunGraphTest, OdometryThatStopsIsADoubt) {
  for (int frame = 12; frame < kFrames; ++frame) {
    detections_[static_cast<std::size_t>(frame)].odometry = detections_[11].odometry;
  }
  EXPECT_EQ(odometry_doubt(detections_, {}), "") << "for a moment";
  for (int frame = 10; frame < kFrames; ++frame) {
    detections_[static_cast<std::size_t>(frame)].odometry = detections_[10].odometry;
  }
  const std::string doubt = odometry_doubt(detections_, {});
  EXPECT_NE(doubt.find("it stands still from frame 10 to the end"), std::string::npos) << doubt;
}

TEST_F(RunGraphTest, PlacesOutOfReachAreADoubtIfMoreThanLoops) {
  for (int frame = 11; frame < kFrames; ++frame) {
    detections_[static_cast<std::size_t>(frame)].status = Status::unreachable;
  }
  EXPECT_NE(odometry_doubt(detections_, {}).find("10 frames show a place that is out of reach"),
            std::string::npos);
  for (int frame = 0; frame < 10; ++frame) {
    detections_[static_cast<std::size_t>(frame)].status = Status::loop;
  }
  EXPECT_EQ(odometry_doubt(detections_, {}), "");
}

TEST_F(RunGraphTest, WithoutOdometryThereIsNothingToCorrect) {
  for (Detection& detection : detections_) detection.odometry.reset();
  test::expect_error(ErrorKind::input, {"No frame has odometry"}, [&] { (void)graph(); });
}

}  // namespace
}  // namespace loopbit
