// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Odometry and relative poses in maps, and maps of the version that had none.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/map_file.hpp"
#include "loopbit/map_tools.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

class MapOdometryTest : public ScratchTest {
 protected:
  /// Two sessions of 5 frames, with a loop between them whose pose was measured.
  void SetUp() override {
    ScratchTest::SetUp();
    map_path_ = path("map.db");
    add_session(map_path_, 5, "first");
    MapWriter map(map_path_, fast_options(), "second");
    for (int frame = 0; frame < 5; ++frame) {
      add_frame(map, frame, frame == 4 ? std::optional(SessionFrame{1, 2}) : std::nullopt);
    }
    map.add_pose({.query = {0, 4}, .match = {1, 2}, .measured = motion_of(4)});
    map.finish();
  }

  static void expect_pose(MapReader& map, const SessionFrame& query, const SessionFrame& match) {
    const std::vector<MapLoopPose> poses = map.loop_poses();
    ASSERT_EQ(poses.size(), 1U);
    EXPECT_EQ(poses[0].query, query);
    EXPECT_EQ(poses[0].match, match);
    EXPECT_EQ(poses[0].measured.known, PoseKnown::metric);
    EXPECT_EQ(poses[0].measured.motion.T_from_to, motion_of(4).motion.T_from_to);
    EXPECT_EQ(poses[0].measured.motion.covariance, motion_of(4).motion.covariance);
  }

  std::string map_path_;
};

TEST_F(MapOdometryTest, IsGivenBackWithTheCovarianceOrDriftOfTheRun) {
  MapReader map(map_path_);
  expect_only_true_places(map);
  const std::vector<MapOdometry> odometry = map.odometry();
  ASSERT_EQ(odometry.size(), 10U);
  EXPECT_EQ(odometry[8].at, (SessionFrame{2, 3}));
  const Motion drifted =
      odometry_step(odometry_of(2).T_odometry_camera, odometry_of(3), fast_options().odometry);
  EXPECT_EQ(odometry[8].pose.covariance, drifted.covariance);
  EXPECT_EQ(odometry[9].pose.covariance, odometry_of(4).covariance);
  expect_pose(map, {2, 4}, {1, 2});
  EXPECT_TRUE(map.damage().empty());
}

TEST_F(MapOdometryTest, OfFramesThatAreNoPlacesIsKept) {
  {
    MapWriter map(map_path_, fast_options(), "third");
    add_frame(map, 0);
    Detection unreadable{.frame = 1, .status = Status::unreadable, .odometry = odometry_of(1)};
    map.add(unreadable, {}, std::make_shared<const Features>(), {});
    Detection unknown{.frame = 2};
    map.add(unknown, content_of(2), std::make_shared<const Features>(few_features(2)), {});
    map.remove(0);
  }
  MapReader map(map_path_);
  EXPECT_EQ(places_of(map).size(), 11U);
  const std::vector<MapOdometry> odometry = map.odometry();
  ASSERT_EQ(odometry.size(), 12U);
  EXPECT_EQ(odometry[10].at, (SessionFrame{3, 0})) << "its place was removed";
  EXPECT_EQ(odometry[11].at, (SessionFrame{3, 1}));
  EXPECT_EQ(odometry[11].timestamp_s, std::nullopt);
  EXPECT_EQ(odometry[11].pose.T_odometry_camera, odometry_of(1).T_odometry_camera);
}

TEST_F(MapOdometryTest, PosesOfWhichNothingIsKnownTakeNoRow) {
  {
    MapWriter map(map_path_, fast_options(), "third");
    add_frame(map, 0);
    map.add_pose({.query = {0, 0}, .match = {1, 1}});
    KnownMotion direction = motion_of(9);
    direction.known = PoseKnown::direction;
    map.add_pose({.query = {0, 0}, .match = {2, 1}, .measured = motion_of(9)});
    map.add_pose({.query = {0, 0}, .match = {2, 1}, .measured = direction});
  }
  MapReader map(map_path_);
  EXPECT_EQ(map.loop_poses().size(), 3U);
  const auto motions = map.motions_of({{{3, 0}, {2, 1}}, {{3, 0}, {1, 1}}, {{2, 4}, {1, 2}}});
  EXPECT_EQ(motions[0].known, PoseKnown::direction) << "the last one counts";
  EXPECT_EQ(motions[1].known, PoseKnown::nothing);
  EXPECT_EQ(motions[2].known, PoseKnown::metric);
}

TEST_F(MapOdometryTest, DamagedRowsAreLeftOutAndTold) {
  const auto expect_left = [&](const std::string& sql, std::size_t odometry, std::size_t poses) {
    const std::string copy = path("copy.db");
    fs::copy_file(map_path_, copy, fs::copy_options::overwrite_existing);
    change(copy, sql);
    MapReader map(copy);
    EXPECT_EQ(map.odometry().size(), odometry) << sql;
    EXPECT_EQ(map.loop_poses().size(), poses) << sql;
    EXPECT_EQ(places_of(map).size(), 10U) << sql;
    EXPECT_EQ(check_map(copy).damage.size(), 11 - odometry - poses) << sql;
    expect_error(ErrorKind::input, {copy, "--recover"}, [&] { merge_map(path("into.db"), copy); });
  };
  expect_left("UPDATE odometry SET frame = 7 WHERE odometry = 2", 9, 1);
  expect_left("UPDATE odometry SET timestamp = NULL WHERE odometry = 2", 9, 1);
  expect_left("UPDATE odometry SET pose = zeroblob(264) WHERE odometry < 4", 7, 1);
  expect_left("UPDATE odometry SET pose = zeroblob(100) WHERE odometry = 4", 9, 1);
  expect_left("UPDATE relative_pose SET known = 'direction'", 10, 0);
  expect_left("UPDATE relative_pose SET known = 'all'", 10, 0);
  expect_left("UPDATE relative_pose SET match_frame = 3", 10, 0);
  expect_left("UPDATE relative_pose SET pose = (SELECT pose FROM odometry WHERE odometry = 5)", 10,
              0);
}

TEST_F(MapOdometryTest, IsMergedRecoveredCompactedAndForgotten) {
  add_session(path("into.db"), 3, "another");
  merge_map(path("into.db"), map_path_);
  MapReader merged(path("into.db"));
  EXPECT_EQ(merged.odometry().size(), 13U);
  EXPECT_EQ(merged.odometry().back().at, (SessionFrame{3, 4}));
  expect_pose(merged, {3, 4}, {2, 2});

  recover_map(map_path_, path("recovered.db"));
  MapReader recovered(path("recovered.db"));
  EXPECT_EQ(recovered.odometry().size(), 10U);
  expect_pose(recovered, {2, 4}, {1, 2});

  CompactOptions budget;
  budget.max_places = 4;
  compact_map(map_path_, budget);
  EXPECT_EQ(MapReader(map_path_).odometry().size(), 10U) << "of frames whose places are gone, too";
  CompactOptions drop;
  drop.drop_sessions = {1};
  compact_map(map_path_, drop);
  MapReader dropped(map_path_);
  EXPECT_EQ(dropped.odometry().size(), 5U);
  EXPECT_TRUE(dropped.loop_poses().empty());
  expect_only_true_places(dropped);
  EXPECT_TRUE(check_map(map_path_).damage.empty());
}

TEST_F(MapOdometryTest, AMapOfVersion3IsReadAndContinued) {
  make_older(map_path_, 3);
  const std::string before = read_bytes(map_path_);
  {
    MapReader map(map_path_);
    EXPECT_TRUE(map.odometry().empty());
    EXPECT_TRUE(map.loop_poses().empty());
    EXPECT_TRUE(check_map(map_path_).damage.empty());
    merge_map(path("into.db"), map_path_);
  }
  EXPECT_EQ(read_bytes(map_path_), before);
  add_session(map_path_, 4, "third");
  MapReader map(map_path_);
  EXPECT_EQ(places_of(map).size(), 14U);
  ASSERT_EQ(map.odometry().size(), 4U);
  EXPECT_EQ(map.odometry()[0].at, (SessionFrame{3, 0}));
  EXPECT_EQ(map.loops().size(), 1U);
  EXPECT_TRUE(check_map(map_path_).damage.empty());
}

TEST_F(MapOdometryTest, AMapOfVersion3IsRecoveredWithoutItsFirstPage) {
  // A larger one, which has other rows where odometry begins today.
  add_session(map_path_, 120, "long");
  {
    MapWriter map(map_path_, fast_options(), "veto");
    map.reject({2, 4}, {1, 2});
  }
  make_older(map_path_, 3);
  std::string bytes = read_bytes(map_path_);
  std::fill_n(bytes.begin(), 16384, '\x5a');
  const MapCheck check = recover_map(write("damaged.db", bytes), path("recovered.db"));
  EXPECT_EQ(check.places, 130);
  EXPECT_EQ(check.damage.size(), 1U);
  MapReader map(path("recovered.db"));
  EXPECT_EQ(map.rejected_loops().size(), 1U);
  EXPECT_TRUE(map.sessions().at(2).linked);
  EXPECT_TRUE(check_map(path("recovered.db")).damage.empty());
}

TEST_F(MapOdometryTest, AnExportHasTheMeasuredEdge) {
  add_session(map_path_, 3, "third", SessionFrame{1, 0});
  MapReader map(map_path_);
  const std::string text = export_loops(map, ExportFormat::g2o);
  const std::string measured = to_g2o_edge(motion_of(4), 2, 9);
  EXPECT_NE(text.find(measured + '\n'), std::string::npos) << text;
  EXPECT_NE(text.find("EDGE_SE3:QUAT 0 12 0 0 0 0 0 0 1 1 0 0 0 0 0 1"), std::string::npos);
}

}  // namespace
}  // namespace loopbit::test
