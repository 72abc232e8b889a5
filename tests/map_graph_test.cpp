// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_graph.hpp"

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "loopbit/g2o_file.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/rigid_motion.hpp"
#include "loopbit/trajectory_error.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

constexpr int kLapFrames = 60;  ///< of a session: one lap
constexpr double kRadius_m = 10;

/// The pose of the camera on a circle, looking ahead. It begins at the origin.
cv::Matx44d true_pose(int frame) {
  const double angle = 2 * std::numbers::pi * frame / kLapFrames;
  return {std::cos(angle), 0, -std::sin(angle), kRadius_m * (std::cos(angle) - 1), 0, 1, 0, 0,
          std::sin(angle), 0, std::cos(angle),  kRadius_m * std::sin(angle),       0, 0, 0, 1};
}

/// Laps on a circle, each a session, by odometry that turns too little and goes too far.
class MapGraphTest : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    map_path_ = path("map.db");
  }

  struct Loop {
    int query = 0;
    SessionFrame match;
    bool is_wrong = false;
  };

  /// Adds a lap with loops to earlier sessions.
  void drive(const std::vector<Loop>& loops, bool has_odometry = true) const {
    MapWriter map(map_path_, fast_options(), "lap");
    cv::Matx44d reckoned = cv::Matx44d::eye();
    reckoned(0, 3) = 100;
    for (int frame = 0; frame < kLapFrames; ++frame) {
      if (frame > 0) reckoned = reckoned * step(frame);
      Detection detection{.frame = frame, .timestamp_s = frame};
      if (has_odometry) detection.odometry = OdometryPose{reckoned};
      for (const Loop& loop : loops) {
        if (loop.query != frame) continue;
        detection.status = Status::loop;
        detection.earlier_match = loop.match;
        map.add_pose(measured(loop));
      }
      map.add(detection, content_of(frame), std::make_shared<const Features>(few_features(frame)),
              {});
    }
    map.finish();
  }

  /// The motion since the frame before, by odometry.
  static cv::Matx44d step(int frame) {
    constexpr double kTurn = -0.001;
    constexpr double kFurther_m = 0.005;
    const cv::Matx44d drift{std::cos(kTurn), 0, -std::sin(kTurn), 0,          0, 1, 0, 0,
                            std::sin(kTurn), 0, std::cos(kTurn),  kFurther_m, 0, 0, 0, 1};
    return rigid::inverse(true_pose(frame - 1)) * true_pose(frame) * drift;
  }

  /// A wrong one puts both cameras at the same place.
  static MapLoopPose measured(const Loop& loop) {
    MapLoopPose pose{.query = {0, loop.query}, .match = loop.match};
    pose.measured.known = PoseKnown::metric;
    pose.measured.motion.covariance = cv::Matx66d::diag({1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6});
    if (!loop.is_wrong) {
      pose.measured.motion.T_from_to =
          rigid::inverse(true_pose(loop.match.frame)) * true_pose(loop.query);
    }
    return pose;
  }

  static constexpr int kRight = 31;

  /// Two laps with kRight loops, the last of which close the second one, and a wrong one.
  void drive_twice() const {
    drive({});
    std::vector<Loop> loops{{21, {1, 50}, true}};
    for (int frame = 0; frame < 50; frame += 2) loops.push_back({frame, {1, frame}});
    for (int frame = 54; frame < kLapFrames; ++frame) loops.push_back({frame, {1, frame - 54}});
    drive(loops);
  }

  /// The error of the corrected trajectories of sessions 1 to `sessions`, aligned together.
  static double error_of(const std::string& folder, int sessions) {
    std::vector<cv::Vec3d> truth_m;
    std::vector<cv::Vec3d> found_m;
    for (int session = 1; session <= sessions; ++session) {
      const auto rows = lines_of(folder + "/corrected_" + std::to_string(session) + ".tum");
      EXPECT_EQ(rows.size(), std::size_t{kLapFrames} + 1);
      for (std::size_t i = 1; i < rows.size(); ++i) {
        std::istringstream row(rows[i]);
        double time_s = 0;
        cv::Vec3d p;
        row >> time_s >> p[0] >> p[1] >> p[2];
        truth_m.push_back(rigid::translation(true_pose(static_cast<int>(time_s))));
        found_m.push_back(p);
      }
    }
    return absolute_trajectory_error_m(found_m, truth_m);
  }

  /// The same of odometry, aligned lap by lap.
  static double odometry_error() {
    std::vector<cv::Vec3d> truth_m{rigid::translation(true_pose(0))};
    std::vector<cv::Vec3d> found_m{truth_m};
    cv::Matx44d reckoned = cv::Matx44d::eye();
    for (int frame = 1; frame < kLapFrames; ++frame) {
      reckoned = reckoned * step(frame);
      truth_m.push_back(rigid::translation(true_pose(frame)));
      found_m.push_back(rigid::translation(reckoned));
    }
    return absolute_trajectory_error_m(found_m, truth_m);
  }

  std::string map_path_;
};

TEST_F(MapGraphTest, CorrectsBothSessionsInOneFrame) {
  drive_twice();
  const std::string before = read_bytes(map_path_);
  MapReader map(map_path_);
  const MapCorrection result = correct_map(map, path("graph"));
  EXPECT_EQ(result.correction.keyframes, 2 * kLapFrames);
  EXPECT_EQ(result.correction.kept(), kRight);
  EXPECT_EQ(result.correction.unjudged, 0);
  ASSERT_EQ(result.rejected.size(), 1U);
  EXPECT_EQ(result.rejected[0].query, (SessionFrame{2, 21}));
  EXPECT_EQ(result.rejected[0].match, (SessionFrame{1, 50}));
  ASSERT_EQ(result.sessions.size(), 2U);
  EXPECT_EQ(result.sessions[1].keyframes, kLapFrames);
  EXPECT_EQ(result.sessions[1].frame_of, 1);
  EXPECT_LT(error_of(path("graph"), 2), 0.5 * odometry_error());
  EXPECT_EQ(read_bytes(map_path_), before) << "it was only read";
}

TEST_F(MapGraphTest, FilesNameFramesBySession) {
  drive_twice();
  MapReader map(map_path_);
  (void)correct_map(map, path("graph"));
  const auto trajectory = lines_of(path("graph/trajectory.csv"));
  ASSERT_EQ(trajectory.size(), 1 + 2 * std::size_t{kLapFrames});
  EXPECT_EQ(trajectory[1].substr(0, 33), "1:0,0,100.0000,0.0000,0.0000,100.");
  EXPECT_EQ(trajectory[kLapFrames + 3].substr(0, 7), "2:2,62,");
  const auto loops = lines_of(path("graph/judged_loops.csv"));
  ASSERT_EQ(loops.size(), std::size_t{kRight} + 2);
  EXPECT_EQ(loops[1].substr(0, 21), "2:0,1:0,kept,metric,,") << "odometry joins no sessions";
  EXPECT_EQ(loops[12].substr(0, 10), "2:21,1:50,");
  EXPECT_EQ(lines_of(path("graph/corrected_2.kitti")).size(), std::size_t{kLapFrames});
  const LoopGraph written = read_g2o(path("graph/graph.g2o"));
  EXPECT_EQ(written.size(), 2 * kLapFrames);
  EXPECT_EQ(written.loops().size(), std::size_t{kRight} + 1);
  EXPECT_FALSE(written.odometry(kLapFrames)) << "another session begins";
}

TEST_F(MapGraphTest, SessionsThatNothingJoinsStayInTheirOwnFrames) {
  drive_twice();
  drive({});
  drive({{10, {1, 10}}}, false);
  drive({{10, {3, 10}}, {12, {3, 12}}, {14, {3, 14}}, {16, {3, 16}}});
  MapReader map(map_path_);
  const MapCorrection result = correct_map(map, path("graph"));
  std::vector<int> frames;
  for (const MapCorrection::Session& session : result.sessions) frames.push_back(session.frame_of);
  EXPECT_EQ(frames, (std::vector<int>{1, 1, 3, 0, 3}));
  EXPECT_EQ(result.sessions[3].keyframes, 0);
  EXPECT_EQ(result.correction.unjudged, 1);
  EXPECT_FALSE(fs::exists(path("graph/corrected_4.tum")));
  EXPECT_EQ(lines_of(path("graph/corrected_3.tum"))[1].substr(0, 18), "0.000000 100 0 0 0")
      << "as its odometry";
}

TEST_F(MapGraphTest, RejectedLoopsAreNotUsedAgain) {
  drive_twice();
  MapCorrection result;
  {
    MapReader map(map_path_);
    result = correct_map(map);
  }
  reject_loops(map_path_, result.rejected);
  EXPECT_TRUE(is_one_file(map_path_));
  MapReader map(map_path_);
  EXPECT_EQ(map.rejected_loops(), result.rejected);
  EXPECT_EQ(map.loops().size(), std::size_t{kRight});
  EXPECT_EQ(export_loops(map, ExportFormat::csv).find(",2,21,1,50,"), std::string::npos);
  MapWriter next(map_path_, fast_options(), "next");
  int visited = 0;
  next.for_each_earlier_loop([&](const SessionFrame& query, const SessionFrame& /*match*/) {
    EXPECT_NE(query.frame, 21);
    ++visited;
  });
  EXPECT_EQ(visited, kRight);
  const MapCorrection again = correct_map(map);
  EXPECT_TRUE(again.rejected.empty());
  EXPECT_EQ(again.correction.kept(), kRight);
  EXPECT_TRUE(check_map(map_path_).damage.empty());
}

TEST_F(MapGraphTest, ADamagedMapIsNotChanged) {
  drive_twice();
  change(map_path_, "UPDATE odometry SET frame = 99 WHERE odometry = 7");
  const std::string before = read_bytes(map_path_);
  MapReader map(map_path_);
  const MapCorrection result = correct_map(map);
  EXPECT_EQ(result.correction.keyframes, 2 * kLapFrames - 1);
  expect_error(ErrorKind::input, {map_path_, "odometry 7"},
               [&] { reject_loops(map_path_, result.rejected); });
  EXPECT_EQ(read_bytes(map_path_), before);
}

TEST_F(MapGraphTest, WithoutOdometryThereIsNothingToCorrect) {
  drive({}, false);
  MapReader map(map_path_);
  expect_error(ErrorKind::input, {map_path_, "no odometry", "--odometry FILE"},
               [&] { (void)correct_map(map, path("graph")); });
  EXPECT_FALSE(fs::exists(path("graph")));
}

}  // namespace
}  // namespace loopbit::test
