// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/world.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

constexpr int kFramesALap = 80;
constexpr std::uint64_t kGolden25 = 13752904130407683372U;
constexpr std::uint64_t kGolden140 = 9857533625846213332U;

/// 2.25 laps of 160 m, 80 frames each, as small pictures.
WorldOptions small_world() {
  WorldOptions options;
  options.frames = 180;
  options.spacing_m = 2.0;
  options.width_px = 160;
  options.height_px = 120;
  return options;
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

std::uint64_t fnv1a(const cv::Mat& image) {
  EXPECT_TRUE(image.isContinuous());
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const std::uint8_t byte : std::vector<std::uint8_t>(image.datastart, image.dataend)) {
    hash = (hash ^ byte) * 0x100000001b3U;
  }
  return hash;
}

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * 3);
}

cv::Mat gray(const cv::Mat& image) {
  cv::Mat channels[3];
  cv::split(image, channels);
  cv::Mat sum;
  cv::add(channels[0], channels[1], sum, cv::noArray(), CV_32F);
  cv::add(sum, channels[2], sum, cv::noArray(), CV_32F);
  return sum / 3.0;
}

/// Gradient magnitude: what is left of a picture when its light is taken away.
cv::Mat edges(const cv::Mat& image) {
  const cv::Mat all = gray(image);
  const cv::Rect inner(0, 0, all.cols - 1, all.rows - 1);
  const cv::Mat dx = all(inner + cv::Point(1, 0)) - all(inner);
  const cv::Mat dy = all(inner + cv::Point(0, 1)) - all(inner);
  cv::Mat magnitude;
  cv::magnitude(dx, dy, magnitude);
  return magnitude;
}

double correlation(const cv::Mat& a, const cv::Mat& b) {
  const cv::Mat from_mean_a = a - cv::mean(a);
  const cv::Mat from_mean_b = b - cv::mean(b);
  return from_mean_a.dot(from_mean_b) / (cv::norm(from_mean_a) * cv::norm(from_mean_b));
}

using Pair = std::pair<int, int>;

std::set<Pair> pairs_of(const std::vector<PlaceRun>& runs) {
  std::set<Pair> pairs;
  for (const PlaceRun& run : runs) {
    for (int frame = run.first; frame <= run.last; ++frame) pairs.emplace(run.query, frame);
  }
  return pairs;
}

std::set<int> queries_of(const std::vector<PlaceRun>& runs) {
  std::set<int> queries;
  for (const PlaceRun& run : runs) queries.insert(run.query);
  return queries;
}

double angle_between(double a, double b) {
  return std::abs(std::remainder(a - b, 2 * std::numbers::pi));
}

/// The rule of World::same_place() as its documentation says it, over all pairs.
std::set<Pair> brute_force(const World& world, double distance_m, double turn_rad) {
  const WorldOptions& options = world.options();
  std::set<Pair> pairs;
  for (int query = 0; query < options.frames; ++query) {
    for (int frame = 0; frame < query; ++frame) {
      const LevelPose a = world.pose(query);
      const LevelPose b = world.pose(frame);
      double turn = angle_between(a.heading_rad, b.heading_rad);
      if (options.opposite_counts) turn = std::min(turn, std::numbers::pi - turn);
      const bool near = std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) <= distance_m;
      if (near && turn <= turn_rad && (query - frame) * options.spacing_m >= 50.0) {
        pairs.emplace(query, frame);
      }
    }
  }
  return pairs;
}

constexpr double kDegree = std::numbers::pi / 180;

std::string refusal_of(const WorldOptions& options) {
  try {
    const World world(options);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::option);
    return error.what();
  }
  return {};
}

TEST(WorldRender, SameOptionsGiveTheSameBytesAndAnotherSeedDoesNot) {
  WorldOptions options = small_world();
  const cv::Mat image = World(options).render(100);
  EXPECT_TRUE(same_bytes(image, World(options).render(100)));
  options.seed = 2;
  EXPECT_GT(mean_difference(image, World(options).render(100)), 5.0);
}

// Recorded on x86-64 with GCC 12. A change of what the world looks like changes these numbers; a
// change of compiler, optimization or machine must not.
TEST(WorldRender, GivesTheSameBytesOnEveryMachine) {
  const World world(small_world());
  EXPECT_EQ(fnv1a(world.render(25)), kGolden25);
  EXPECT_EQ(fnv1a(world.render(140)), kGolden140);
}

WorldOptions small_tower() {
  WorldOptions options = small_world();
  options.frames = 600;
  options.laps = 2;
  options.floors = 3;
  options.spacing_m = 1.1;
  return options;
}

TEST(WorldFloors, LookAlikeAndStandOnEachOther) {
  WorldOptions options = small_tower();
  options.moving_objects = 0;
  options.noise = 0;
  options.light_change = 0;
  const World world(options);
  EXPECT_NEAR(world.circuit_m(), 110, 1e-9);
  EXPECT_EQ(world.lap(399), 3);
  EXPECT_EQ(world.lap(400), 4);
  // Away from the ramp, and from where the camera comes back from the line of the second lap.
  const LevelPose below = world.pose(60);
  const LevelPose above = world.pose(260);
  EXPECT_EQ(below.z_m, 0);
  EXPECT_EQ(above.z_m, 3);
  EXPECT_EQ(world.pose(599).z_m, 6);
  EXPECT_NEAR(std::hypot(below.x_m - above.x_m, below.y_m - above.y_m), 0, 0.4);
  EXPECT_GT(correlation(edges(world.render(60)), edges(world.render(260))), 0.5);
  EXPECT_EQ(world.T_world_camera(260)(1, 3), world.T_world_camera(60)(1, 3) - 3);
  for (int frame = 1; frame < options.frames; ++frame) {
    const LevelPose from = world.pose(frame - 1);
    const LevelPose to = world.pose(frame);
    EXPECT_LT(std::hypot(to.x_m - from.x_m, to.y_m - from.y_m), 1.5) << frame;
    EXPECT_LT(to.z_m - from.z_m, 0.3) << frame;
  }
}

TEST(WorldFloors, PlacesOfOtherFloorsAreOthers) {
  const World world(small_tower());
  const std::set<Pair> same = pairs_of(world.same_place());
  EXPECT_FALSE(same.empty());
  const std::set<Pair> near = pairs_of(world.near_place());
  for (const auto& [query, frame] : near) {
    EXPECT_LE(std::abs(world.pose(query).z_m - world.pose(frame).z_m), 1);
  }
  for (const auto& [query, frame] : same) {
    EXPECT_EQ(world.pose(query).z_m, world.pose(frame).z_m);
    EXPECT_EQ(std::remainder(world.pose(query).z_m, 3), 0) << "on a ramp";
  }
  EXPECT_TRUE(std::ranges::includes(near, same));
  // The first lap on each floor has none, the second has, but for the ramp.
  EXPECT_FALSE(queries_of(world.near_place()).contains(250));
  const std::set<int> queries = queries_of(world.same_place());
  EXPECT_TRUE(queries.contains(350));
  EXPECT_FALSE(world.blank(350));
  EXPECT_TRUE(world.blank(390));
  EXPECT_GT(*queries.lower_bound(373), 490) << "on the next floor";
  EXPECT_TRUE(near.contains({375, 275})) << "where the ramp begins";
  EXPECT_FALSE(near.contains({390, 290}));
}

/// How well one view of a still world foretells another by its depths and the poses of both.
double foretold(const World& world, int from, int to) {
  const cv::Mat1f depth_m = world.depth_m(from);
  const CameraModel a = world.camera(from);
  const CameraModel b = world.camera(to);
  const cv::Matx44d T_to_from = world.T_world_camera(to).inv() * world.T_world_camera(from);
  cv::Mat1f x(depth_m.size(), -1.0F);
  cv::Mat1f y(depth_m.size(), -1.0F);
  cv::Mat1b is_seen(depth_m.size(), std::uint8_t{0});
  for (int row = 0; row < depth_m.rows; ++row) {
    for (int column = 0; column < depth_m.cols; ++column) {
      const auto depth = static_cast<double>(depth_m(row, column));
      if (depth <= 0 || depth > 40) continue;
      const cv::Vec4d at = T_to_from * cv::Vec4d((column - a.cx) / a.fx * depth,
                                                 (row - a.cy) / a.fy * depth, depth, 1);
      if (at[2] < 1) continue;
      x(row, column) = static_cast<float>(b.cx + b.fx * at[0] / at[2]);
      y(row, column) = static_cast<float>(b.cy + b.fy * at[1] / at[2]);
      const cv::Rect2f image(1, 1, static_cast<float>(depth_m.cols - 3),
                             static_cast<float>(depth_m.rows - 3));
      is_seen(row, column) = image.contains({x(row, column), y(row, column)}) ? 1 : 0;
    }
  }
  cv::Mat warped;
  cv::remap(gray(world.render(to)), warped, x, y, cv::INTER_LINEAR);
  const cv::Mat seen = gray(world.render(from));
  cv::Mat1d pairs(0, 2);
  for (int row = 0; row < depth_m.rows; ++row) {
    for (int column = 0; column < depth_m.cols; ++column) {
      if (is_seen(row, column) == 0) continue;
      pairs.push_back(
          cv::Mat1d(cv::Matx12d(seen.at<float>(row, column), warped.at<float>(row, column))));
    }
  }
  EXPECT_GT(pairs.rows, depth_m.rows * depth_m.cols / 10) << from << ' ' << to;
  return correlation(pairs.col(0), pairs.col(1));
}

TEST(WorldFloors, PlacesThatAreTheSameAreSeenWhereTheirPosesSay) {
  WorldOptions options = small_tower();
  options.moving_objects = 0;
  options.noise = 0;
  options.light_change = 0;
  const World world(options);
  int pairs = 0;
  for (const PlaceRun& run : world.same_place()) {
    if (run.query % 3 != 0) continue;
    EXPECT_GT(foretold(world, run.query, run.last), 0.6) << run.query << ' ' << run.last;
    ++pairs;
  }
  EXPECT_GT(pairs, 60);
}

TEST(WorldFloors, BadOptionsAreNamed) {
  WorldOptions options = small_tower();
  options.reverse_second_lap = true;
  EXPECT_NE(refusal_of(options).find("world.floors is 3"), std::string::npos);
  options = small_tower();
  options.frames = 500;
  EXPECT_NE(refusal_of(options).find("take 579 frames or more"), std::string::npos)
      << refusal_of(options);
}

TEST(WorldOdometry, DriftsAsItsCovariancesSay) {
  double sum = 0;
  double heights = 0;
  int count = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    WorldOptions options = small_tower();
    options.seed = seed;
    const World world(options);
    const std::vector<OdometryPose> odometry = drifting_odometry(world);
    EXPECT_EQ(odometry[70].T_odometry_camera, drifting_odometry(world)[70].T_odometry_camera);
    OdometryTrack track;
    for (const OdometryPose& pose : odometry) track.add(pose);
    for (const int to : {199, 399, 599}) {
      const int from = to - 199;
      const Motion motion = track.between(from, to).value();
      const cv::Matx44d truth = world.T_world_camera(from).inv() * world.T_world_camera(to);
      const cv::Matx44d error = motion.T_from_to.inv() * truth;
      const cv::Vec3d p(error(0, 3), error(1, 3), error(2, 3));
      sum += p.dot(motion.covariance.get_minor<3, 3>(0, 0).inv() * p) / 3;
      heights += p[1] * p[1];
      ++count;
    }
  }
  EXPECT_GT(sum / count, 0.5);
  EXPECT_LT(sum / count, 1.6);
  // 1 % of 10 m, for 220 m.
  EXPECT_NEAR(std::sqrt(heights / count), 0.1 * std::sqrt(22), 0.2);
}

TEST(WorldRender, HasTheSizeAskedFor) {
  WorldOptions options = small_world();
  options.width_px = 321;
  options.height_px = 97;
  const cv::Mat image = World(options).render(0);
  EXPECT_EQ(image.size(), cv::Size(321, 97));
  EXPECT_EQ(image.type(), CV_8UC3);
}

TEST(WorldRender, AFisheyeSeesWhatAPinholeSees) {
  WorldOptions options = small_world();
  options.noise = 0;
  const World pinhole(options);
  options.fisheye_deg = 150;
  const World fisheye(options);
  const CameraModel flat = pinhole.camera(25);
  const CameraModel bent = fisheye.camera(25);
  EXPECT_EQ(bent.lens, Lens::equidistant);
  const cv::Mat3b seen = pinhole.render(25);
  const cv::Mat3b image = fisheye.render(25);
  double difference = 0;
  int compared = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const auto ray = unproject(bent, {static_cast<double>(x), static_cast<double>(y)});
      const auto at = ray ? project(flat, *ray) : std::nullopt;
      if (!at) continue;
      const cv::Point pixel(cvRound((*at)[0]), cvRound((*at)[1]));
      if (!cv::Rect({}, seen.size()).contains(pixel)) continue;
      ++compared;
      difference += cv::norm(cv::Vec3d(seen(pixel)) - cv::Vec3d(image(y, x)), cv::NORM_L1) / 3;
    }
  }
  EXPECT_GT(compared, 4000);
  EXPECT_LT(difference / compared, 12);
}

TEST(WorldRender, AFisheyeIsBlackBeyond80Degrees) {
  WorldOptions options = small_world();
  options.noise = 0;
  options.fisheye_deg = 170;
  const World world(options);
  const cv::Mat3b image = world.render(25);
  for (int y = 0; y < image.rows; y += 7) {
    for (int x = 0; x < image.cols; ++x) {
      const auto ray =
          unproject(world.camera(25), {static_cast<double>(x), static_cast<double>(y)});
      ASSERT_TRUE(ray);
      constexpr double kCos80 = 0.1736;
      constexpr double kMargin = 0.01;
      if ((*ray)[2] > kCos80 - kMargin) continue;
      EXPECT_EQ(image(y, x), cv::Vec3b()) << x << ' ' << y;
    }
  }
  EXPECT_NE(image(60, 80), cv::Vec3b());
}

TEST(WorldRender, DependsNeitherOnOrderNorOnThreads) {
  const World world(small_world());
  const std::vector<int> frames{0, 33, 80, 121, 179};
  std::vector<cv::Mat> forwards;
  forwards.reserve(frames.size());
  for (const int frame : frames) forwards.push_back(world.render(frame));
  std::vector<cv::Mat> one(frames.size());
  std::vector<cv::Mat> other(frames.size());
  const auto draw_backwards = [&](std::vector<cv::Mat>& into) {
    for (std::size_t i = frames.size(); i-- > 0;) into[i] = world.render(frames[i]);
  };
  std::thread thread([&] { draw_backwards(one); });
  draw_backwards(other);
  thread.join();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_TRUE(same_bytes(forwards[i], one[i])) << "frame " << frames[i];
    EXPECT_TRUE(same_bytes(forwards[i], other[i])) << "frame " << frames[i];
  }
}

TEST(WorldRender, NoiseHasTheStandardDeviationAskedFor) {
  WorldOptions options = small_world();
  options.noise = 0.0;
  const cv::Mat clean = gray(World(options).render(25));
  options.noise = 5.0;
  const cv::Mat noisy = gray(World(options).render(25));
  const cv::Mat middle = (clean > 40.0F) & (clean < 215.0F);  // where nothing is clipped
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(noisy - clean, mean, deviation, middle);
  EXPECT_NEAR(mean[0], 0.0, 0.2);
  EXPECT_NEAR(deviation[0], 5.0, 0.3);
}

/// Mean difference between the frames of the second lap and those of the first in the same places.
double change_between_laps(const WorldOptions& options) {
  const World world(options);
  double sum = 0.0;
  for (int frame = 15; frame < kFramesALap; frame += 8) {
    sum += mean_difference(world.render(frame), world.render(frame + kFramesALap));
  }
  return sum;
}

TEST(WorldRender, EveryFactorChangesTheLapsByItself) {
  WorldOptions still = small_world();
  still.noise = 0.0;
  still.light_change = 0.0;
  still.moving_objects = 0.0;
  still.lateral_offset_m = 0.0;
  const double least = change_between_laps(still);
  WorldOptions options = still;
  options.light_change = 1.0;
  EXPECT_GT(change_between_laps(options), 2 * least);
  options = still;
  options.moving_objects = 1.0;
  EXPECT_GT(change_between_laps(options), 1.2 * least);
  options = still;
  options.lateral_offset_m = 3.0;
  EXPECT_GT(change_between_laps(options), 1.5 * least);
}

TEST(WorldRender, NightAndSeasonChangeLaterLapsAndNoTruth) {
  WorldOptions options = small_world();
  const World plain(options);
  options.night = 0.7;
  options.season = 0.7;
  const World changed(options);
  EXPECT_TRUE(same_bytes(plain.render(25), changed.render(25)));
  EXPECT_GT(mean_difference(plain.render(25 + kFramesALap), changed.render(25 + kFramesALap)), 20);
  EXPECT_EQ(pairs_of(plain.same_place()), pairs_of(changed.same_place()));
  EXPECT_EQ(pairs_of(plain.near_place()), pairs_of(changed.near_place()));
}

/// How much of the structure of the first lap the second one shows.
double similarity_of_laps(const WorldOptions& options) {
  const World world(options);
  double sum = 0.0;
  for (int frame = 15; frame < kFramesALap; frame += 4) {
    sum += correlation(edges(world.render(frame)), edges(world.render(frame + kFramesALap)));
  }
  return sum;
}

TEST(WorldRender, MoreNightAndMoreSeasonLeaveLessInCommon) {
  for (double WorldOptions::*factor : {&WorldOptions::night, &WorldOptions::season}) {
    WorldOptions options = small_world();
    double before = similarity_of_laps(options);
    for (const double share : {0.5, 1.0}) {
      options.*factor = share;
      const double similarity = similarity_of_laps(options);
      EXPECT_LT(similarity, before) << "night " << options.night << ", season " << options.season;
      before = similarity;
    }
  }
}

TEST(WorldRender, LookAlikesChangeTheHouses) {
  WorldOptions options = small_world();
  options.look_alike = 0.0;
  const cv::Mat unique = World(options).render(10);
  options.look_alike = 1.0;
  EXPECT_GT(mean_difference(unique, World(options).render(10)), 3.0);
}

TEST(WorldRender, LapsLookDifferentButShowTheSameStructure) {
  const World world(small_world());
  double same = 0.0;
  double elsewhere = 0.0;
  int frames = 0;
  for (int frame = 15; frame < kFramesALap; frame += 5) {
    if (world.blank(frame)) continue;
    const cv::Mat first = world.render(frame);
    const cv::Mat again = world.render(frame + kFramesALap);
    const cv::Mat other = world.render((frame + kFramesALap / 4) % kFramesALap);
    EXPECT_GT(mean_difference(first, again), 10.0) << "frame " << frame;
    same += correlation(edges(first), edges(again));
    elsewhere += correlation(edges(other), edges(again));
    ++frames;
  }
  ASSERT_GE(frames, 8);
  EXPECT_GT(same / frames, elsewhere / frames + 0.15);
}

TEST(WorldRender, BlankStretchHasHardlyAnyTexture) {
  WorldOptions options = small_world();
  options.noise = 0.0;
  options.moving_objects = 0.0;
  options.blank_stretch = 0.3;
  const World world(options);
  double blank = 0.0;
  double other = 0.0;
  int blank_frames = 0;
  for (int frame = 0; frame < kFramesALap; ++frame) {
    const cv::Mat image = world.render(frame);
    const double texture = cv::mean(edges(image.rowRange(image.rows / 3, image.rows)))[0];
    (world.blank(frame) ? blank : other) += texture;
    blank_frames += world.blank(frame) ? 1 : 0;
  }
  EXPECT_NEAR(blank_frames, 0.3 * kFramesALap, 1.0);
  EXPECT_LT(blank / blank_frames, 0.5 * other / (kFramesALap - blank_frames));
}

TEST(WorldDrive, LapsFollowEachOtherAndStayBesideTheFirst) {
  WorldOptions options = small_world();
  options.lateral_offset_m = 2.0;
  const World world(options);
  EXPECT_NEAR(world.circuit_m(), 160.0, 1e-9);
  for (int frame = 0; frame < options.frames; ++frame) {
    EXPECT_EQ(world.lap(frame), frame / kFramesALap) << "frame " << frame;
  }
  for (int frame = 15; frame < kFramesALap; ++frame) {
    const LevelPose first = world.pose(frame);
    const LevelPose second = world.pose(frame + kFramesALap);
    const double left = -(second.x_m - first.x_m) * std::sin(first.heading_rad) +
                        (second.y_m - first.y_m) * std::cos(first.heading_rad);
    EXPECT_NEAR(left, 2.0, 0.35) << "frame " << frame;
    EXPECT_LT(angle_between(first.heading_rad, second.heading_rad), 5 * kDegree);
  }
}

TEST(WorldDrive, LooksWhereItDrivesWithoutLeaps) {
  WorldOptions options;
  options.frames = 5000;
  for (const int seed : {1, 2, 3}) {
    options.seed = seed;
    const World world(options);
    for (int frame = 1; frame < options.frames; ++frame) {
      const LevelPose from = world.pose(frame - 1);
      const LevelPose to = world.pose(frame);
      const double step = std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
      ASSERT_GT(step, 0.6 * options.spacing_m) << "frame " << frame;
      ASSERT_LT(step, 1.4 * options.spacing_m) << "frame " << frame;
      const double way = std::atan2(to.y_m - from.y_m, to.x_m - from.x_m);
      ASSERT_LT(angle_between(way, to.heading_rad), 8 * kDegree) << "frame " << frame;
    }
  }
}

TEST(WorldDrive, LongWorldsAreSmallAndWind) {
  WorldOptions options;
  options.frames = 20'000;
  const World world(options);
  EXPECT_NEAR(world.circuit_m(), 8000.0, 1e-6);
  EXPECT_LT(world.storage_bytes(), 32U * 1024U);
  // Within one lap no place is seen twice, but for the metres around the start.
  for (const PlaceRun& run : world.same_place()) {
    if (world.lap(run.query) == 0) {
      ASSERT_LT(run.last, 10) << "query " << run.query;
    }
  }
  EXPECT_EQ(world.render(19'999).size(), cv::Size(640, 480));
}

struct TruthCase {
  bool reverse;
  bool opposite;
};

class WorldTruth : public testing::TestWithParam<TruthCase> {};

TEST_P(WorldTruth, IsExact) {
  WorldOptions options = small_world();
  options.frames = 500;
  options.spacing_m = 1.0;
  options.laps = 3.3;
  options.reverse_second_lap = GetParam().reverse;
  options.opposite_counts = GetParam().opposite;
  const World world(options);
  const std::set<Pair> same = pairs_of(world.same_place());
  const std::set<Pair> near = pairs_of(world.near_place());
  EXPECT_EQ(same, brute_force(world, options.same_place_m, 30 * kDegree));
  EXPECT_EQ(near, brute_force(world, options.near_place_m, 60 * kDegree));
  EXPECT_TRUE(std::includes(near.begin(), near.end(), same.begin(), same.end()));
  EXPECT_GT(near.size(), same.size());
}

INSTANTIATE_TEST_SUITE_P(Directions, WorldTruth,
                         testing::Values(TruthCase{false, false}, TruthCase{true, false},
                                         TruthCase{true, true}));

TEST(WorldTruth, RunsAreSortedAndApart) {
  WorldOptions options = small_world();
  options.laps = 3.3;
  const std::vector<PlaceRun> runs = World(options).near_place();
  ASSERT_GT(runs.size(), 100U);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    EXPECT_LE(runs[i].first, runs[i].last);
    if (i == 0 || runs[i - 1].query != runs[i].query) continue;
    EXPECT_GT(runs[i].first, runs[i - 1].last + 1);
  }
}

TEST(WorldTruth, BeginsWithTheSecondLap) {
  const WorldOptions options = small_world();
  const World world(options);
  const std::set<int> queries = queries_of(world.same_place());
  const int back_at_start = kFramesALap - 2;  // 4 m before the end of the first lap
  for (int frame = 0; frame < back_at_start; ++frame) EXPECT_EQ(queries.count(frame), 0U) << frame;
  for (int frame = kFramesALap; frame < options.frames; ++frame) {
    EXPECT_EQ(queries.count(frame), 1U) << frame;
  }
}

TEST(WorldTruth, OppositeDirectionCountsOnlyWhenAsked) {
  WorldOptions options = small_world();
  options.reverse_second_lap = true;
  const World one_way(options);
  const LevelPose out = one_way.pose(20);
  const LevelPose back = one_way.pose(2 * kFramesALap - 20);
  EXPECT_LT(std::hypot(out.x_m - back.x_m, out.y_m - back.y_m), options.same_place_m);
  EXPECT_NEAR(angle_between(out.heading_rad, back.heading_rad), std::numbers::pi, 0.1);
  const std::set<int> seen = queries_of(one_way.same_place());
  options.opposite_counts = true;
  const std::set<int> any_way = queries_of(World(options).same_place());
  // 25 frames, 50 m, must lie between a frame and its like.
  for (int frame = kFramesALap + 14; frame < 2 * kFramesALap - 2; ++frame) {
    EXPECT_EQ(seen.count(frame), 0U) << frame;
    EXPECT_EQ(any_way.count(frame), 1U) << frame;
  }
  for (int frame = 2 * kFramesALap; frame < options.frames; ++frame) {
    EXPECT_EQ(seen.count(frame), 1U) << frame;
  }
}

TEST(WorldOptionsCheck, NamesWhatIsWrong) {
  WorldOptions options = small_world();
  EXPECT_EQ(refusal_of(options), "");
  options.light_change = 1.5;
  EXPECT_EQ(refusal_of(options), "world.light_change is 1.5, but must be between 0 and 1.");
  options = small_world();
  options.spacing_m = std::nan("");
  EXPECT_NE(refusal_of(options).find("world.spacing_m"), std::string::npos);
  options = small_world();
  options.near_place_m = 3.0;
  EXPECT_NE(refusal_of(options).find("world.near_place_m is 3,"), std::string::npos);
}

TEST(WorldOptionsCheck, RefusesADriveTooShortForItsLapsAndSaysWhatWouldDo) {
  WorldOptions options;
  options.frames = 100;
  EXPECT_EQ(refusal_of(options),
            "world: 100 frames 0.9 m apart in 2.25 laps make a circuit of 40 m, but the shortest "
            "has 106 m: take 265 frames or more, or set spacing_m to 2.39 or more.");
  options.frames = 265;
  EXPECT_EQ(refusal_of(options), "");
  options.frames = 264;
  EXPECT_NE(refusal_of(options), "");
  options.frames = 100;
  options.spacing_m = 2.39;
  EXPECT_EQ(refusal_of(options), "");
  options.frames = 4;
  const std::string refusal = refusal_of(options);
  EXPECT_NE(refusal.find("take 100 frames or more."), std::string::npos) << refusal;
}

TEST(WorldSource, YieldsTheWholeDrive) {
  WorldOptions options = small_world();
  options.frames = 60;
  options.spacing_m = 5.0;
  const auto world = std::make_shared<const World>(options);
  const auto source = make_world_source(world);
  EXPECT_EQ(source->size(), 60U);
  EXPECT_NE(source->description().find("60 frames"), std::string::npos);
  Frame frame;
  ASSERT_TRUE(source->next(frame));
  EXPECT_EQ(frame.name, "000000");
  EXPECT_EQ(frame.timestamp_s, 0.0);
  EXPECT_TRUE(same_bytes(frame.image, world->render(0)));
  ASSERT_TRUE(source->skip());
  ASSERT_TRUE(source->next(frame));
  EXPECT_EQ(frame.name, "000002");
  EXPECT_EQ(frame.timestamp_s, 0.2);
  EXPECT_EQ(frame.error, "");
  EXPECT_TRUE(same_bytes(frame.image, world->render(2)));
  int left = 0;
  while (source->skip()) ++left;
  EXPECT_EQ(left, 57);
  EXPECT_FALSE(source->next(frame));
}

}  // namespace
}  // namespace loopbit
