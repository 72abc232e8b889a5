// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/poses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "camera_poses.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

using Poses = std::vector<std::optional<CameraPose>>;
using Pairs = std::set<std::pair<int, int>>;

constexpr double kDeg = CV_PI / 180;

CameraPose pose_at(double x, double z, double heading_deg = 0) {
  return {{}, {x, 0, z}, {std::sin(heading_deg * kDeg), 0, std::cos(heading_deg * kDeg)}};
}

Pairs expanded(const std::vector<PlaceRun>& runs) {
  Pairs pairs;
  for (const PlaceRun& run : runs) {
    for (int place = run.first; place <= run.last; ++place) {
      EXPECT_TRUE(pairs.emplace(run.query, place).second) << run.query << ' ' << place << " twice";
    }
  }
  return pairs;
}

struct Truth {
  Pairs same;
  Pairs near;
  std::vector<int> unknown;
};

/// The rule as its documentation says it, over all pairs.
Truth brute_force(const Poses& poses, const PoseTruthOptions& options) {
  Truth truth;
  for (std::size_t q = 0; q < poses.size(); ++q) {
    if (!poses[q]) {
      truth.unknown.push_back(static_cast<int>(q));
      continue;
    }
    double path_m = 0;
    std::size_t last = q;
    for (std::size_t p = q; p-- > 0;) {
      const auto pair = std::pair(static_cast<int>(q), static_cast<int>(p));
      if (!poses[p]) continue;
      path_m += cv::norm(poses[last]->position_m - poses[p]->position_m);
      last = p;
      const double distance_m = cv::norm(poses[q]->position_m - poses[p]->position_m);
      const double cosine = std::clamp(poses[q]->ahead.dot(poses[p]->ahead), -1.0, 1.0);
      const bool same =
          distance_m <= options.radius_m && pair.first - pair.second > options.min_gap_frames &&
          path_m >= options.min_path_m && std::acos(cosine) / kDeg <= options.max_heading_deg;
      if (same) truth.same.insert(pair);
      const bool grey = options.grey_radius_m > 0;
      if (grey && (same || distance_m <= options.grey_radius_m)) truth.near.insert(pair);
    }
  }
  return truth;
}

void expect_brute_force(const Poses& poses, const PoseTruthOptions& options) {
  const GroundTruth truth = truth_from_poses(poses, options);
  const Truth expected = brute_force(poses, options);
  EXPECT_FALSE(expected.same.empty()) << "this test shows nothing";
  EXPECT_EQ(expanded(truth.same_place), expected.same);
  EXPECT_EQ(expanded(truth.near_place), expected.near);
  EXPECT_EQ(truth.unknown, expected.unknown);
}

/// A walk that turns at random about the origin, with frames here and there whose pose is missing.
Poses random_walk(test::Random& random, int frames) {
  Poses poses;
  cv::Vec3d at(0, 0, 0);
  double heading_deg = 0;
  for (int i = 0; i < frames; ++i) {
    heading_deg += 20 * random.normal();
    CameraPose pose = pose_at(0, 0, heading_deg);
    at = 0.97 * at + pose.ahead + cv::Vec3d(0, 0.2 * random.normal(), 0);
    pose.position_m = at;
    poses.emplace_back(pose);
    if (random.between(0, 9) == 0) poses.back().reset();
  }
  return poses;
}

PoseTruthOptions near_options() { return {.radius_m = 5, .min_gap_frames = 1, .min_path_m = 0}; }

TEST(TruthFromPoses, AgreesWithAllPairsOnRandomWalks) {
  test::Random random;
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(i);
    const PoseTruthOptions options{.radius_m = 1.0 + 3 * random.uniform(),
                                   .min_gap_frames = random.between(1, 60),
                                   .min_path_m = i % 2 * 80.0 * random.uniform(),
                                   .max_heading_deg = i % 3 == 0 ? 180.0 : 45.0,
                                   .grey_radius_m = i % 4 * 2.0};
    expect_brute_force(random_walk(random, 400), options);
  }
}

PoseTruthOptions random_options(test::Random& random) {
  return {.radius_m = 1.0 + 3 * random.uniform(),
          .min_gap_frames = random.between(0, 60),
          .min_path_m = random.between(0, 1) * 40.0 * random.uniform(),
          .max_heading_deg = random.between(0, 1) == 0 ? 180.0 : 20.0 + 60 * random.uniform(),
          .grey_radius_m = random.between(0, 2) * 4.0 * random.uniform()};
}

/// Laps of a circle with stops, each pose up to `noise_m` beside it; a few are missing.
Poses laps_with_stops(test::Random& random, int frames, double noise_m) {
  Poses poses;
  double angle_deg = 0;
  bool stands = false;
  for (int i = 0; i < frames; ++i) {
    if (random.between(0, 30) == 0) stands = !stands;
    if (!stands) angle_deg += 10;
    const double around = angle_deg * kDeg;
    poses.emplace_back(pose_at(8 * std::cos(around), 8 * std::sin(around), angle_deg));
    poses.back()->position_m += noise_m * cv::Vec3d(random.normal(), 0, random.normal());
    if (random.between(0, 40) == 0) poses.back().reset();
  }
  return poses;
}

TEST(TruthFromPoses, AgreesWithAllPairsOnLapsWithStops) {
  test::Random random(1);
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(i);
    PoseTruthOptions options = random_options(random);
    options.min_path_m = 0;  // where the robot stands most of the time
    expect_brute_force(laps_with_stops(random, 300, i % 3 * 0.2), options);
  }
}

TEST(TruthFromPoses, AgreesWithAllPairsWherePosesJump) {
  test::Random random(2);
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(i);
    Poses poses;
    for (int k = 0; k < 300; ++k) {
      poses.emplace_back(
          pose_at(10 * random.uniform(), 10 * random.uniform(), 360 * random.uniform()));
    }
    expect_brute_force(poses, random_options(random));
  }
}

TEST(TruthFromPoses, AStandingCameraIsOneRunAQuery) {
  // Pair by pair this takes minutes.
  constexpr int kFrames = 100'000;
  const PoseTruthOptions options{.max_heading_deg = 90, .grey_radius_m = 6};
  const GroundTruth still = truth_from_poses(Poses(kFrames, pose_at(1, 2, 30)), options);
  EXPECT_EQ(still.same_place.size(), static_cast<std::size_t>(kFrames - 151));
  EXPECT_EQ(still.same_place.back(), (PlaceRun{kFrames - 1, 0, kFrames - 152}));
  EXPECT_EQ(still.near_place.back(), (PlaceRun{kFrames - 1, 0, kFrames - 2}));

  test::Random random(3);
  Poses trembling;
  for (int i = 0; i < kFrames; ++i) {
    trembling.emplace_back(pose_at(0.1 * random.normal(), 0.1 * random.normal(), random.normal()));
  }
  EXPECT_EQ(truth_from_poses(trembling, options).same_place, still.same_place);

  // As far from the first half as the radius goes, to the last bit.
  Poses two_places(kFrames, pose_at(0, 0));
  std::fill(two_places.begin() + kFrames / 2, two_places.end(), pose_at(0, 6));
  EXPECT_EQ(truth_from_poses(two_places).same_place.size(), still.same_place.size());
}

TEST(TruthFromPoses, RefusesACameraThatIsElsewhereInEveryFrame) {
  Poses poses;  // half of all pairs of frames show one place, and each pair is a run
  for (int i = 0; i < 100'000; ++i) poses.emplace_back(pose_at(100 * (i % 2), 0));
  test::expect_error(ErrorKind::input, {"of 100000", "back and forth", "fewer frames"},
                     [&] { (void)truth_from_poses(poses); });
}

TEST(TruthFromPoses, ScalesWithPlacesFarFromTheOrigin) {
  Poses poses;
  for (const double x : {1e9 - 7, -1e9, 1e9 - 2, -1e9 + 4, 1e9 - 7}) {
    poses.emplace_back(pose_at(x, x));
  }
  expect_brute_force(poses, {.radius_m = 7.1, .min_gap_frames = 1});
}

TEST(TruthFromPoses, TheRadiusIsInAndTheGapIsOut) {
  // Steps of 3 and 4 m: frame 2 is 5 m from frame 0 and 4 from frame 1.
  const Poses poses{pose_at(0, 0), pose_at(3, 0), pose_at(3, 4), pose_at(0, 0)};
  PoseTruthOptions options = near_options();
  EXPECT_EQ(truth_from_poses(poses, options).same_place,
            (std::vector<PlaceRun>{{2, 0, 0}, {3, 0, 1}}));
  options.radius_m = 4.999;
  EXPECT_EQ(truth_from_poses(poses, options).same_place, (std::vector<PlaceRun>{{3, 0, 1}}));
  options.min_gap_frames = 2;
  EXPECT_EQ(truth_from_poses(poses, options).same_place, (std::vector<PlaceRun>{{3, 0, 0}}));
  options.min_gap_frames = 3;
  EXPECT_TRUE(truth_from_poses(poses, options).same_place.empty());
}

TEST(TruthFromPoses, TheSmallestPathIsIn) {
  const Poses poses{pose_at(0, 0), pose_at(3, 0), pose_at(3, 4), pose_at(0, 0)};
  PoseTruthOptions options = near_options();
  options.min_path_m = 12;
  EXPECT_EQ(truth_from_poses(poses, options).same_place, (std::vector<PlaceRun>{{3, 0, 0}}));
  options.min_path_m = 12.001;
  EXPECT_TRUE(truth_from_poses(poses, options).same_place.empty());
}

TEST(TruthFromPoses, TheLargestHeadingIsIn) {
  const Poses poses{pose_at(0, 0, 0), pose_at(1, 0, 0), pose_at(0, 0, 90), pose_at(0, 0, 180)};
  PoseTruthOptions options = near_options();
  options.max_heading_deg = 90;
  EXPECT_EQ(truth_from_poses(poses, options).same_place, (std::vector<PlaceRun>{{2, 0, 0}}));
  options.max_heading_deg = 89.999;
  EXPECT_TRUE(truth_from_poses(poses, options).same_place.empty());
  options.max_heading_deg = 180;
  EXPECT_EQ(truth_from_poses(poses, options).same_place,
            (std::vector<PlaceRun>{{2, 0, 0}, {3, 0, 1}}));
}

TEST(TruthFromPoses, TheGreyZoneKnowsNeitherGapNorHeading) {
  const Poses poses{pose_at(0, 0), pose_at(8, 0), pose_at(0, 0, 180)};
  PoseTruthOptions options{.radius_m = 1, .min_gap_frames = 1, .max_heading_deg = 45};
  EXPECT_TRUE(truth_from_poses(poses, options).near_place.empty());
  options.grey_radius_m = 8;
  EXPECT_EQ(truth_from_poses(poses, options).near_place,
            (std::vector<PlaceRun>{{1, 0, 0}, {2, 0, 1}}));
  EXPECT_TRUE(truth_from_poses(poses, options).same_place.empty());
}

TEST(TruthFromPoses, FramesWithoutPoseAreUnknown) {
  const Poses poses{pose_at(0, 0), {}, {}, pose_at(0, 0), {}, pose_at(50, 0)};
  const GroundTruth truth = truth_from_poses(poses, near_options());
  EXPECT_EQ(truth.unknown, (std::vector<int>{1, 2, 4}));
  EXPECT_EQ(truth.same_place, (std::vector<PlaceRun>{{3, 0, 0}}));
  EXPECT_TRUE(truth.near_place.empty());
  EXPECT_TRUE(truth_from_poses({}, {}).same_place.empty());
}

TEST(TruthFromPoses, RefusesWhatIsNoPositionOrOption) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double x : {kNan, std::numeric_limits<double>::infinity(), 1e10, -1e300}) {
    test::expect_error(ErrorKind::input, {"frame 1"}, [&] {
      truth_from_poses({pose_at(0, 0), pose_at(x, 0)});
    });
  }
  test::expect_error(ErrorKind::input, {"frame 0"},
                     [&] { truth_from_poses({pose_at(0, 0, kNan)}); });
  PoseTruthOptions options;
  options.radius_m = kNan;
  test::expect_error(ErrorKind::option, {"radius_m"}, [&] { truth_from_poses({}, options); });
}

class PosesTest : public test::ScratchTest {};

TEST_F(PosesTest, ReadsKittiRows) {
  // The camera looks along the world's x axis.
  const auto poses = read_poses(write(
      "kitti.txt", "# made up\n0 0 1 5.5 0 1 0 -2 -1 0 0 1e1\r\n1,0,0,0, 0,1,0,0, 0,0,1,0\n"));
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].position_m, cv::Vec3d(5.5, -2, 10));
  EXPECT_EQ(poses[0].ahead, cv::Vec3d(1, 0, 0));
  EXPECT_EQ(poses[1].ahead, cv::Vec3d(0, 0, 1));
  EXPECT_FALSE(poses[0].timestamp_s);
}

TEST_F(PosesTest, FramesLeftOutHaveRowsLeftOut) {
  std::string rows;
  for (int i = 0; i < 7; ++i) rows += fmt::format("1 0 0 {} 0 1 0 0 0 0 1 0\n", i);
  const std::string file = write("kitti.txt", rows);
  const auto frames = [](std::size_t count, int every = 3) {
    return FramesRead{.every = every, .times_s = FrameTimes(count)};
  };
  const Positions positions_m = read_positions(file, frames(3));
  ASSERT_EQ(positions_m.size(), 3U);
  EXPECT_EQ(positions_m[2], cv::Vec3d(6, 0, 0));
  EXPECT_EQ(read_positions(file, frames(2)).size(), 2U) << "the run ended early";
  EXPECT_EQ(read_positions(file, frames(0)).size(), 7U) << "frames that are not known";
  const auto expect_too_few = [&](const auto& read) {
    test::expect_error(ErrorKind::input, {file, "7 poses", "10 frames"}, read);
  };
  expect_too_few([&] { (void)read_positions(file, frames(4)); });
  expect_too_few([&] { check_poses(file, frames(4)); });
  check_poses(file, frames(3));
  check_poses(file, frames(0));
  test::expect_error(ErrorKind::option, {"every is 0"},
                     [&] { (void)read_positions(file, frames(1, 0)); });
}

TEST_F(PosesTest, ReadsTumRows) {
  // No turn; then 90 degrees about y, which turns z to x.
  const auto poses = read_poses(write("tum.txt",
                                      "# timestamp tx ty tz qx qy qz qw\n"
                                      "1305031098.6659 1 2 3 0 0 0 1\n"
                                      "1305031098.7659 1 2 3 0 0.70710678 0 0.70710678\n"));
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].timestamp_s, 1305031098.6659);
  EXPECT_EQ(poses[0].position_m, cv::Vec3d(1, 2, 3));
  EXPECT_LT(cv::norm(poses[0].ahead - cv::Vec3d(0, 0, 1)), 1e-12);
  EXPECT_LT(cv::norm(poses[1].ahead - cv::Vec3d(1, 0, 0)), 1e-7);
}

TEST_F(PosesTest, BadRowsNameFileAndLine) {
  const std::string kitti = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string tum = "1.5 1 2 3 0 0 0 1\n";
  for (const auto& [first, row] : std::vector<std::pair<std::string, std::string>>{
           {kitti, tum},
           {tum, kitti},
           {kitti, "2 0 0 0 0 2 0 0 0 0 2 0"},    // scales
           {kitti, "1 0 0 0 0 1 0 0 0 0 -1 0"},   // mirrors
           {kitti, "1 0 0 nan 0 1 0 0 0 0 1 0"},  // nowhere
           {kitti, "1 0 0 0 0 1 0 0 0 0 1"},
           {kitti, "1 0 0 0 0 1 0 0 0 0 1 0 0"},
           {kitti, "1 0 0 x 0 1 0 0 0 0 1 0"},
           {tum, "1.6 1 2 3 0 0 0 0"},
           {tum, "1.6 1 2 3 0 0 0 2"},
           {tum, "inf 1 2 3 0 0 0 1"}}) {
    SCOPED_TRACE(row);
    const std::string file = write("poses.txt", first + row);
    test::expect_error(ErrorKind::input, {file, "line 2"}, [&] { read_poses(file); });
  }
  const std::string empty = write("empty.txt", "# nothing\n");
  test::expect_error(ErrorKind::input, {empty}, [&] { read_poses(empty); });
}

CameraPose timed(double time_s, double x) {
  CameraPose pose = pose_at(x, 0);
  pose.timestamp_s = time_s;
  return pose;
}

/// The x of each frame's pose, -1 where there is none.
std::vector<double> found_at(const std::vector<CameraPose>& poses,
                             const std::vector<std::optional<double>>& times_s) {
  std::vector<double> xs;
  for (const auto& pose : poses_of_frames(poses, times_s)) {
    xs.push_back(pose ? pose->position_m[0] : -1);
  }
  return xs;
}

TEST(PosesOfFrames, TakesTheNearestInTime) {
  const std::vector<CameraPose> poses{timed(1, 1), timed(2, 2), timed(2.0625, 3)};
  EXPECT_EQ(found_at(poses, {0.9, 0.96, 1.04, 1.06, 2.03, 2.04, 2.2, {}}),
            (std::vector<double>{-1, 1, 1, -1, 2, 3, -1, -1}));
  EXPECT_EQ(found_at(poses, {2.03125}), (std::vector<double>{2})) << "the earlier of two as near";
}

TEST(PosesOfFrames, SortsByTimeAndTakesTheFirstOfTwins) {
  EXPECT_EQ(found_at({timed(3, 3), timed(1, 1), timed(3, 4), timed(2, 2)}, {1.0, 2.0, 3.0}),
            (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(found_at({timed(1, 1), timed(1, 2), timed(3, 3), timed(3, 4)}, {0.99, 1.01, 3.01}),
            (std::vector<double>{1, 1, 3}));
}

TEST(PosesOfFrames, WithoutTimesRowsAreFrames) {
  EXPECT_EQ(found_at({pose_at(5, 0), pose_at(6, 0)}, {{}, {}}), (std::vector<double>{5, 6}));
  EXPECT_EQ(found_at({pose_at(5, 0), pose_at(6, 0)}, {0.0, 0.1}), (std::vector<double>{5, 6}));
  EXPECT_EQ(found_at({timed(1, 5), timed(2, 6)}, {{}, {}}), (std::vector<double>{5, 6}));
}

TEST(PosesOfFrames, SaysWhatDoesNotFit) {
  test::expect_error(ErrorKind::input, {"1 poses", "2 frames", "the poses have no times"}, [] {
    poses_of_frames({pose_at(5, 0)}, {0.0, 0.1});
  });
  test::expect_error(ErrorKind::input, {"1 poses", "2 frames", "the frames have no times"}, [] {
    poses_of_frames({timed(5, 0)}, {{}, {}});
  });
  test::expect_error(ErrorKind::input, {"100.000000 s", "0.500000 s"}, [] {
    poses_of_frames({timed(100, 0)}, {{}, 0.5});
  });
}

Poses real_poses(const std::string& name) {
  const auto poses = read_poses((test::data_dir().value() / name).string());
  return {poses.begin(), poses.end()};
}

TEST(RealPoses, AgreeWithAllPairs) {
  for (const char* name : {"05", "00"}) {
    const std::string file = fmt::format("truth/poses/{}.txt", name);
    LOOPBIT_NEEDS_DATA(file);
    const Poses poses = real_poses(file);
    expect_brute_force(poses, {});
    expect_brute_force(poses, {.min_path_m = 50, .max_heading_deg = 60, .grey_radius_m = 20});
  }
}

TEST(RealPoses, AllKindsAreRead) {
  LOOPBIT_NEEDS_DATA("truth/poses");
  for (const auto& [name, rows] :
       std::vector<std::pair<std::string, std::size_t>>{{"truth/poses/00.txt", 4541},
                                                        {"truth/poses/02.txt", 4661},
                                                        {"truth/poses/05.txt", 2761},
                                                        {"truth/poses/06.txt", 1101},
                                                        {"truth/poses/07.txt", 1101},
                                                        {"truth/poses/08.txt", 4071},
                                                        {"truth/poses/09.txt", 1591},
                                                        {"kitti03/poses.txt", 401},
                                                        {"euroc_room/poses.txt", 100}}) {
    SCOPED_TRACE(name);
    LOOPBIT_NEEDS_DATA(name);
    EXPECT_EQ(real_poses(name).size(), rows);
  }
}

}  // namespace
}  // namespace loopbit
