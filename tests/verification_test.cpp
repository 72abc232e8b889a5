// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/verification.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "test_cameras.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

using Matches = std::vector<Match>;

// Matching

Descriptor descriptor_of(int first, int second = 0) {
  Descriptor descriptor{};
  descriptor[0] = static_cast<std::int8_t>(first);
  descriptor[1] = static_cast<std::int8_t>(second);
  return descriptor;
}

Features features_of(const std::vector<Descriptor>& dark, const std::vector<Descriptor>& bright) {
  Features features;
  features.num_dark = dark.size();
  features.descriptors = dark;
  features.descriptors.insert(features.descriptors.end(), bright.begin(), bright.end());
  features.keypoints.resize(features.descriptors.size());
  return features;
}

double distance_sq(const Descriptor& a, const Descriptor& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] - b[i], 2);
  return sum;
}

bool same_sign(const Features& a, std::size_t i, const Features& b, std::size_t k) {
  return (i < a.num_dark) == (k < b.num_dark);
}

/// The nearest feature of `others` with the sign of `features`' i-th, if it is
/// near enough compared with all the others.
std::optional<std::size_t> distinct_nearest(const Features& features, std::size_t i,
                                            const Features& others, double max_ratio) {
  std::optional<std::size_t> nearest;
  const auto distance_sq_to = [&](std::size_t k) {
    return distance_sq(features.descriptors[i], others.descriptors[k]);
  };
  for (std::size_t k = 0; k < others.descriptors.size(); ++k) {
    if (!same_sign(features, i, others, k)) continue;
    if (!nearest || distance_sq_to(k) < distance_sq_to(*nearest)) nearest = k;
  }
  for (std::size_t k = 0; nearest && k < others.descriptors.size(); ++k) {
    if (k == *nearest || !same_sign(features, i, others, k)) continue;
    if (distance_sq_to(*nearest) >= max_ratio * max_ratio * distance_sq_to(k)) return std::nullopt;
  }
  return nearest;
}

Matches match_by_plain_loops(const Features& query, const Features& place, double max_ratio) {
  Matches matches;
  for (std::size_t q = 0; q < query.descriptors.size(); ++q) {
    const auto p = distinct_nearest(query, q, place, max_ratio);
    if (p && distinct_nearest(place, *p, query, max_ratio) == q) {
      matches.push_back({static_cast<int>(q), static_cast<int>(*p)});
    }
  }
  return matches;
}

/// Descriptors around `num_kinds` centres, so that there are near ones, and equal ones where
/// `spread` is 0.
std::vector<Descriptor> random_descriptors(Random& random, int num, int num_kinds, int spread) {
  std::vector<Descriptor> centres(static_cast<std::size_t>(num_kinds));
  Random of_centres(1);
  for (Descriptor& centre : centres) {
    for (std::int8_t& value : centre) value = static_cast<std::int8_t>(of_centres.between(-60, 60));
  }
  std::vector<Descriptor> descriptors;
  for (int i = 0; i < num; ++i) {
    descriptors.push_back(centres[static_cast<std::size_t>(random.between(0, num_kinds - 1))]);
    for (std::int8_t& value : descriptors.back()) {
      value = static_cast<std::int8_t>(value + random.between(-spread, spread));
    }
  }
  return descriptors;
}

void expect_as_plain_loops(const Features& query, const Features& place) {
  for (const double max_ratio : {0.3, 0.8, 0.95, 1.0}) {
    ASSERT_EQ(match_features(query, place, max_ratio),
              match_by_plain_loops(query, place, max_ratio))
        << max_ratio;
  }
}

TEST(MatchFeatures, AgreesWithPlainLoops) {
  Random random;
  std::size_t most = 0;
  for (const int num_kinds : {1, 10, 60, 400}) {
    for (const int spread : {0, 1, 8, 60}) {
      SCOPED_TRACE("kinds " + std::to_string(num_kinds) + ", spread " + std::to_string(spread));
      const auto some = [&](int num) { return random_descriptors(random, num, num_kinds, spread); };
      const Features query = features_of(some(37), some(50));
      const Features place = features_of(some(61), some(24));
      expect_as_plain_loops(query, place);
      most = std::max(most, match_features(query, place, 0.8).size());
    }
  }
  EXPECT_GT(most, 10U) << "nothing was compared";
}

TEST(MatchFeatures, AgreesWithPlainLoopsOnSmallGroups) {
  Random random;
  const auto some = [&](int num) { return random_descriptors(random, num, 3, 2); };
  for (int run = 0; run < 200; ++run) {
    expect_as_plain_loops(features_of(some(random.between(0, 3)), some(random.between(0, 3))),
                          features_of(some(random.between(0, 3)), some(random.between(0, 3))));
  }
}

TEST(MatchFeatures, AgreesWithPlainLoopsOnImages) {
  const SurfOptions options{.working_area_px = 320 * 240, .max_keypoints = 250};
  expect_as_plain_loops(extract_surf(view(1), options), extract_surf(view(1, {9, 4}), options));
}

TEST(MatchFeatures, NothingMatchesNothing) {
  const Features one = features_of({descriptor_of(5)}, {});
  EXPECT_TRUE(match_features({}, {}, 0.8).empty());
  EXPECT_TRUE(match_features(one, {}, 0.8).empty());
  EXPECT_TRUE(match_features({}, one, 0.8).empty());
}

TEST(MatchFeatures, LoneFeatureIsDistinctHoweverFar) {
  Descriptor lowest;
  Descriptor highest;
  lowest.fill(-127);
  highest.fill(127);
  EXPECT_EQ(match_features(features_of({lowest}, {}), features_of({highest}, {}), 0.1),
            (Matches{{0, 0}}));
}

TEST(MatchFeatures, DarkAndBrightAreNotCompared) {
  const Features dark = features_of({descriptor_of(5)}, {});
  const Features bright = features_of({}, {descriptor_of(5)});
  EXPECT_TRUE(match_features(dark, bright, 1.0).empty());
  EXPECT_EQ(match_features(bright, bright, 1.0), (Matches{{0, 0}}));
}

TEST(MatchFeatures, RatioItselfIsNotEnough) {
  const Features query = features_of({descriptor_of(0)}, {});
  const Features place = features_of({descriptor_of(4), descriptor_of(-8)}, {});
  EXPECT_EQ(match_features(query, place, 0.51).size(), 1U);
  EXPECT_EQ(match_features(query, place, 0.5).size(), 0U);
}

TEST(MatchFeatures, RatioHoldsFromEitherSide) {
  const Features one = features_of({descriptor_of(0)}, {});
  const Features two = features_of({descriptor_of(4), descriptor_of(-5)}, {});
  EXPECT_TRUE(match_features(one, two, 0.7).empty());
  EXPECT_TRUE(match_features(two, one, 0.7).empty());
}

TEST(MatchFeatures, OneFeatureIsInOneMatch) {
  const Features query = features_of({descriptor_of(10), descriptor_of(12), descriptor_of(14)}, {});
  const Features place = features_of({descriptor_of(12), descriptor_of(90)}, {});
  EXPECT_EQ(match_features(query, place, 1.0), (Matches{{1, 0}}));
}

TEST(MatchFeatures, TiesGoToNeither) {
  const Features query = features_of({descriptor_of(0, 3), descriptor_of(0, -3)}, {});
  const Features place = features_of({descriptor_of(3), descriptor_of(-3)}, {});
  EXPECT_TRUE(match_features(query, place, 1.0).empty());
}

// Geometry

constexpr double kErrorPx = 2.0;

struct TwoViews {
  Features query;
  Features place;
  Matches matches;
  std::size_t num_right = 0;  ///< the first matches are right, the others random

  void add(cv::Point2d in_query, cv::Point2d in_place) {
    const auto keypoint = [](cv::Point2d p) {
      return Keypoint{.x_px = static_cast<float>(p.x), .y_px = static_cast<float>(p.y)};
    };
    const auto index = static_cast<int>(matches.size());
    matches.push_back({index, index});
    query.keypoints.push_back(keypoint(in_query));
    place.keypoints.push_back(keypoint(in_place));
  }
};

cv::Point2d random_pixel(Random& random) {
  return {640 * random.uniform(), 480 * random.uniform()};
}

/// A point in the camera's coordinates, in metres, as a pixel of a 640 x 480 image.
cv::Point2d projected(const cv::Point3d& point_m) {
  return {320 + 500 * point_m.x / point_m.z, 240 + 500 * point_m.y / point_m.z};
}

/// Points 4 to 20 m ahead seen from two places 0.7 m apart, turned by 5 degrees, to 0.3 px; and
/// `num_random` pairs of unrelated pixels.
TwoViews two_views(Random& random, int num_right, int num_random) {
  TwoViews views;
  const double turn_rad = 0.087;
  while (static_cast<int>(views.matches.size()) < num_right) {
    const double z = 4 + 16 * random.uniform();
    const double y = 10 * (random.uniform() - 0.5);
    const double x = 16 * (random.uniform() - 0.5);
    const cv::Point3d p(x, y, z);
    const cv::Point3d q = p - cv::Point3d(0.5, 0.05, 0.5);
    const cv::Point3d turned(std::cos(turn_rad) * q.x - std::sin(turn_rad) * q.z, q.y,
                             std::sin(turn_rad) * q.x + std::cos(turn_rad) * q.z);
    const double noise_y = 0.3 * random.normal();
    const double noise_x = 0.3 * random.normal();
    views.add(projected(p), projected(turned) + cv::Point2d(noise_x, noise_y));
  }
  views.num_right = views.matches.size();
  for (int i = 0; i < num_random; ++i) {
    const cv::Point2d in_place = random_pixel(random);
    views.add(random_pixel(random), in_place);
  }
  return views;
}

Matches inliers_of(const TwoViews& views) {
  return epipolar_inliers(views.query, views.place, views.matches, kErrorPx);
}

int count_right(const TwoViews& views, const Matches& inliers) {
  return static_cast<int>(std::count_if(inliers.begin(), inliers.end(), [&](const Match& match) {
    return match.query < static_cast<int>(views.num_right);
  }));
}

TEST(EpipolarInliers, FindsNearlyAllRightMatchesAmongOutliers) {
  for (int run = 0; run < 10; ++run) {
    Random random(run);
    const TwoViews views = two_views(random, 60, 40);
    const Matches inliers = inliers_of(views);
    const int right = count_right(views, inliers);
    EXPECT_GE(right, 57) << run;
    // An outlier may lie on its epipolar line by chance.
    EXPECT_LE(static_cast<int>(inliers.size()) - right, 5) << run;
  }
}

/// OpenCV's MAGSAC++ (Barath et al., CVPR 2020), with as many samples as we take at most.
std::size_t opencv_inliers(const TwoViews& views) {
  std::vector<cv::Point2f> query;
  std::vector<cv::Point2f> place;
  for (const Keypoint& k : views.query.keypoints) query.emplace_back(k.x_px, k.y_px);
  for (const Keypoint& k : views.place.keypoints) place.emplace_back(k.x_px, k.y_px);
  cv::Mat is_inlier;
  cv::findFundamentalMat(query, place, cv::USAC_MAGSAC, kErrorPx, 0.999, 1000, is_inlier);
  return static_cast<std::size_t>(cv::countNonZero(is_inlier));
}

TEST(EpipolarInliers, AreAboutAsManyAsOpenCvFinds) {
  for (int run = 0; run < 10; ++run) {
    Random random(run);
    const TwoViews views = two_views(random, 50, 50);
    const auto expected = static_cast<double>(opencv_inliers(views));
    EXPECT_NEAR(static_cast<double>(inliers_of(views).size()), expected, 0.1 * expected) << run;
  }
}

TEST(EpipolarInliers, KeepsTheOrderAndThePairsOfTheMatches) {
  Random random;
  TwoViews views = two_views(random, 30, 0);
  std::reverse(views.place.keypoints.begin(), views.place.keypoints.end());
  for (Match& match : views.matches) match.place = 29 - match.place;
  const Matches inliers = inliers_of(views);
  EXPECT_GE(inliers.size(), 28U);
  EXPECT_TRUE(std::includes(views.matches.begin(), views.matches.end(), inliers.begin(),
                            inliers.end(),
                            [](const Match& a, const Match& b) { return a.query < b.query; }));
  for (const Match& match : inliers) EXPECT_EQ(match.place, 29 - match.query);
}

TEST(EpipolarInliers, AreTheSameEveryTime) {
  Random random;
  const TwoViews views = two_views(random, 40, 60);
  const Matches first = inliers_of(views);
  cv::theRNG().state = 12345;
  EXPECT_EQ(inliers_of(views), first);
  static_cast<void>(inliers_of(two_views(random, 20, 20)));
  EXPECT_EQ(inliers_of(views), first);
}

/// Points all around a camera that moves 0.9 m and turns by 17 degrees, to 0.3 px; those in view of
/// both images. Then `num_random` pairs of unrelated pixels.
TwoViews views_through(const CameraModel& camera, Random& random, int num_right, int num_random) {
  TwoViews views;
  views.query.working_size_px = views.place.working_size_px = camera.size_px;
  const cv::Rect2d image({}, cv::Size2d(camera.size_px));
  cv::Matx33d turn;
  cv::Rodrigues(cv::Vec3d(0.05, 0.28, -0.03), turn);
  // Each number by a statement of its own: compilers differ in the order of arguments.
  const auto noisy = [&](const cv::Vec2d& pixel) {
    const double y = pixel[1] + 0.3 * random.normal();
    return cv::Point2d(pixel[0] + 0.3 * random.normal(), y);
  };
  while (static_cast<int>(views.matches.size()) < num_right) {
    const double z_m = 10 * random.uniform();
    const double y_m = 10 * random.uniform() - 5;
    const cv::Vec3d point_m(10 * random.uniform() - 5, y_m, z_m);
    const auto a = project(camera, point_m);
    const auto b = project(camera, turn * (point_m - cv::Vec3d(0.8, -0.1, 0.4)));
    if (!a || !b || !image.contains(cv::Point2d(*a)) || !image.contains(cv::Point2d(*b))) continue;
    const cv::Point2d in_place = noisy(*b);
    views.add(noisy(*a), in_place);
  }
  views.num_right = views.matches.size();
  for (int i = 0; i < num_random; ++i) {
    const double y_px = random.uniform() * image.height;
    const cv::Point2d in_place(random.uniform() * image.width, y_px);
    views.add({random.uniform() * image.width, random.uniform() * image.height}, in_place);
  }
  return views;
}

TEST(EpipolarInliers, OfRaysFindNearlyAllRightMatchesThroughAnyLens) {
  for (const CameraModel& camera : {test::pinhole(), test::euroc(), test::fisheye()}) {
    for (int run = 0; run < 10; ++run) {
      Random random(run);
      const TwoViews views = views_through(camera, random, 60, 40);
      const Matches inliers =
          epipolar_inliers(views.query, views.place, views.matches, kErrorPx, &camera);
      const int right = count_right(views, inliers);
      EXPECT_GE(right, 57) << to_string(camera.lens) << ' ' << run;
      EXPECT_LE(static_cast<int>(inliers.size()) - right, 5)
          << to_string(camera.lens) << ' ' << run;
      EXPECT_EQ(epipolar_inliers(views.query, views.place, views.matches, kErrorPx, &camera),
                inliers);
    }
  }
}

TEST(EpipolarInliers, OfPixelsMissMatchesThroughAFisheye) {
  Random random;
  const TwoViews views = views_through(test::fisheye(), random, 60, 40);
  EXPECT_LT(count_right(views, inliers_of(views)), 52);
}

TEST(EpipolarInliers, OfRaysAreThoseOfTheResizedImage) {
  Random random;
  CameraModel large = test::fisheye();
  const TwoViews views = views_through(large, random, 60, 40);
  large = resized(large, {1280, 960});
  const CameraModel own = test::fisheye();
  EXPECT_EQ(epipolar_inliers(views.query, views.place, views.matches, kErrorPx, &large),
            epipolar_inliers(views.query, views.place, views.matches, kErrorPx, &own));
}

TEST(EpipolarInliers, NeedImagesOfOneSizeForRays) {
  Random random;
  TwoViews views = views_through(test::fisheye(), random, 60, 40);
  const CameraModel camera = test::fisheye();
  EXPECT_EQ(chance_inliers(views.query, views.place, &camera), 6);
  EXPECT_EQ(chance_inliers(views.query, views.place, nullptr), 8);
  views.place.working_size_px = {700, 438};
  EXPECT_EQ(chance_inliers(views.query, views.place, &camera), 8);
  EXPECT_EQ(epipolar_inliers(views.query, views.place, views.matches, kErrorPx, &camera),
            inliers_of(views));
}

TEST(EpipolarInliers, OfRaysNeverLieWhereTheLensSeesNothing) {
  CameraModel camera = test::fisheye();
  camera.distortion = {-0.2};  // turns back 1.3 rad from the axis
  Random random;
  TwoViews views = views_through(test::fisheye(), random, 40, 0);
  views.add({1, 1}, {2, 2});
  ASSERT_FALSE(unproject(camera, {1, 1}));
  for (const Match& inlier :
       epipolar_inliers(views.query, views.place, views.matches, kErrorPx, &camera)) {
    EXPECT_LT(inlier.query, 40);
  }
}

TEST(EpipolarInliers, NeedEightMatches) {
  Random random;
  const TwoViews views = two_views(random, 8, 0);
  EXPECT_FALSE(inliers_of(views).empty());
  for (int few = 0; few < 8; ++few) EXPECT_TRUE(inliers_of(two_views(random, few, 0)).empty());
}

TEST(EpipolarInliers, UnrelatedMatchesHaveFew) {
  for (int run = 0; run < 10; ++run) {
    Random random(run);
    const std::size_t inliers = inliers_of(two_views(random, 0, 100)).size();
    EXPECT_LE(inliers, 15U) << run;
  }
}

TEST(EpipolarInliers, DegenerateMatchesDoNotThrow) {
  for (const int num : {8, 9, 20, 100}) {
    TwoViews same_point;
    TwoViews line;
    TwoViews identical;
    Random random;
    for (int i = 0; i < num; ++i) {
      same_point.add({100, 100}, {200, 50});
      line.add({10.0 + i, 20.0 + 2 * i}, {30.0 + i, 7.0 + i});
      const cv::Point2d pixel = random_pixel(random);
      identical.add(pixel, pixel);
    }
    for (const TwoViews& views : {same_point, line, identical}) {
      EXPECT_LE(inliers_of(views).size(), static_cast<std::size_t>(num));
    }
  }
}

// Evidence

/// Keypoints of the scale 2 at the same pixels of both images, all of them inliers.
TwoViews still_views(const std::vector<cv::Point2d>& pixels) {
  TwoViews views;
  for (const cv::Point2d& pixel : pixels) views.add(pixel, pixel);
  for (Keypoint& keypoint : views.query.keypoints) keypoint.scale = 2;
  for (Keypoint& keypoint : views.place.keypoints) keypoint.scale = 2;
  return views;
}

int distinct(const TwoViews& views, double min_spacing_scales = 10) {
  return distinct_inliers(views.query, views.place, views.matches, min_spacing_scales);
}

TEST(DistinctInliers, LieApartByScalesOrMore) {
  EXPECT_EQ(distinct(still_views({{100, 100}, {120, 100}, {100, 120}})), 3);
  EXPECT_EQ(distinct(still_views({{100, 100}, {119, 100}})), 1);
  EXPECT_EQ(distinct(still_views({{100, 100}, {114, 114}})), 1);
  EXPECT_EQ(distinct(still_views({{100, 100}, {115, 115}})), 2);
}

TEST(DistinctInliers, MustLieApartInBothImages) {
  TwoViews views = still_views({{100, 100}, {200, 100}});
  views.place.keypoints[1].x_px = 110;
  EXPECT_EQ(distinct(views), 1);
  std::swap(views.query, views.place);
  EXPECT_EQ(distinct(views), 1);
}

TEST(DistinctInliers, SmallerScaleDecides) {
  TwoViews views = still_views({{100, 100}, {115, 100}});
  EXPECT_EQ(distinct(views), 1);
  views.query.keypoints[1].scale = views.place.keypoints[1].scale = 1.5F;
  EXPECT_EQ(distinct(views), 2);
}

TEST(DistinctInliers, FirstComeFirstServed) {
  // The middle one is too close to both others, which are apart.
  EXPECT_EQ(distinct(still_views({{100, 100}, {115, 100}, {130, 100}})), 2);
  EXPECT_EQ(distinct(still_views({{115, 100}, {100, 100}, {130, 100}})), 1);
}

TEST(DistinctInliers, WithoutSpacingAllCount) {
  const TwoViews views = still_views({{100, 100}, {100, 100}, {101, 100}});
  EXPECT_EQ(distinct(views, 0), 3);
  EXPECT_EQ(distinct(views, 10), 1);
  EXPECT_EQ(distinct({}), 0);
}

// Both

// The share of features that inliers explain

/// Features at `points`, of which the first `num_inliers` are inliers.
double share(const std::vector<cv::Point2d>& points, int num_inliers) {
  TwoViews views;
  for (const cv::Point2d& point : points) views.add(point, point);
  views.matches.resize(static_cast<std::size_t>(num_inliers));
  return explained_share(views.query, views.matches);
}

TEST(ExplainedShare, IsThatOfTheFeaturesAmidTheInliers) {
  const std::vector<cv::Point2d> points{{100, 100}, {200, 100}, {100, 200}, {200, 200},
                                        {150, 150}, {120, 180}, {300, 150}, {150, 99}};
  EXPECT_DOUBLE_EQ(share(points, 4), 4.0 / 6);
  EXPECT_DOUBLE_EQ(share(points, 5), 5.0 / 6);
  EXPECT_DOUBLE_EQ(share(points, 8), 1);
  EXPECT_DOUBLE_EQ(share(points, 1), 1);
  EXPECT_DOUBLE_EQ(share(points, 0), 0);
}

TEST(ExplainedShare, LeavesOutTheOuterTenths) {
  std::vector<cv::Point2d> points;
  for (int i = 0; i < 10; ++i) points.emplace_back(10 * i, 10 * i);
  EXPECT_DOUBLE_EQ(share(points, 10), 1);
  points.emplace_back(5, 5);    // beyond the second of ten
  points.emplace_back(50, 50);  // amid them
  EXPECT_DOUBLE_EQ(share(points, 10), 8.0 / 9);
}

TEST(Verify, ShiftedViewHasManyInliers) {
  const Features query = extract_surf(view(2));
  const Verification result = verify(query, extract_surf(view(2, {12, 5})));
  EXPECT_GT(result.inliers.size(), 100U);
  EXPECT_LE(result.inliers.size(), result.matches.size());
  EXPECT_GT(result.distinct_inliers, 40);
  EXPECT_LT(result.distinct_inliers, static_cast<int>(result.inliers.size()));
}

TEST(Verify, HalvesMakeTheWhole) {
  Verifier verifier;
  Verification halves;
  const Features query = extract_surf(view(2));
  for (const cv::Point moved : {cv::Point(12, 5), cv::Point(0, 0), cv::Point(30, -20)}) {
    const Features place = extract_surf(view(2, moved));
    const Verification whole = verify(query, place);
    verifier.match(query, place, halves);
    EXPECT_EQ(halves.matches, whole.matches);
    EXPECT_TRUE(halves.inliers.empty());
    verifier.find_geometry(query, place, halves);
    EXPECT_EQ(halves.inliers, whole.inliers);
    EXPECT_EQ(halves.distinct_inliers, whole.distinct_inliers);
  }
}

/// The first features of each sign, `num` in all, as many of each as their share is.
Features strongest(const Features& all, std::size_t num) {
  const std::size_t dark = all.num_dark * num / all.keypoints.size();
  const auto part = [&](const auto& of) {
    auto kept = of;
    kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(all.num_dark + num - dark), kept.end());
    kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(dark),
               kept.begin() + static_cast<std::ptrdiff_t>(all.num_dark));
    return kept;
  };
  return {all.working_size_px, dark, part(all.keypoints), part(all.descriptors)};
}

TEST(Verify, AFirstLookMatchesTheStrongestFeatures) {
  constexpr std::size_t kLooked = 60;
  const Features query = extract_surf(view(2));
  const Features place = extract_surf(view(2, {12, 5}));
  const Features of_query = strongest(query, kLooked);
  const Features of_place = strongest(place, kLooked);
  Verifier verifier;
  FirstLook look;
  verifier.match_strongest(query, place, kLooked, look);
  const std::vector<Match> expected = match_features(of_query, of_place, 0.8);
  ASSERT_GT(expected.size(), 5U);
  ASSERT_EQ(look.matches.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto at = [](const Features& features, int index) {
      return features.descriptors[static_cast<std::size_t>(index)];
    };
    EXPECT_EQ(at(query, look.matches[i].query), at(of_query, expected[i].query));
    EXPECT_EQ(at(place, look.matches[i].place), at(of_place, expected[i].place));
  }
}

TEST(Verify, MatchesOfSomeFeaturesAreThoseOfAll) {
  const Features query = extract_surf(view(2));
  const Features place = extract_surf(view(2, {12, 5}));
  const std::vector<Match> all = match_features(query, place, 0.8);
  Verifier verifier;
  Verification some;
  const auto num = static_cast<int>(query.descriptors.size());
  for (const int step : {1, 3, 50}) {
    std::vector<int> asked;
    for (int i = step / 2; i < num; i += step) asked.push_back(i);
    std::vector<Match> expected;
    std::copy_if(all.begin(), all.end(), std::back_inserter(expected), [&](const Match& match) {
      return std::binary_search(asked.begin(), asked.end(), match.query);
    });
    ASSERT_FALSE(expected.empty());
    verifier.match_some(query, asked, place, some);
    EXPECT_EQ(some.matches, expected) << step;
  }
  verifier.match_some(query, {}, place, some);
  EXPECT_TRUE(some.matches.empty());
  verifier.match_some(query, std::array{0, num - 1}, {}, some);
  EXPECT_TRUE(some.matches.empty());
}

TEST(Verify, AFirstLookAtFewFeaturesIsAWholeOne) {
  const Features query = extract_surf(view(2), {.max_keypoints = 100});
  const Features place = extract_surf(view(2, {12, 5}), {.max_keypoints = 90});
  Verifier verifier;
  FirstLook look;
  verifier.match_strongest(query, place, 300, look);
  EXPECT_EQ(look.matches, verify(query, place).matches);
  verifier.match_strongest(query, {}, 300, look);
  EXPECT_TRUE(look.matches.empty());
}

/// `features` with each descriptor twice, so that all distances are those of several.
Features with_twins(Features features) {
  for (std::size_t i = 0; i + 1 < features.descriptors.size(); i += 2) {
    features.descriptors[i + 1] = features.descriptors[i];
  }
  return features;
}

TEST(Verify, AFirstLookChangesNoMatch) {
  const Features query = extract_surf(view(2));
  const Features nearby = extract_surf(view(2, {12, 5}));
  const std::vector<Features> places = {nearby,
                                        query,
                                        with_twins(nearby),
                                        extract_surf(view(3)),
                                        extract_surf(view(2, {12, 5}), {.max_keypoints = 50}),
                                        {}};
  Verification result;
  FirstLook look;
  Verifier verifier;
  for (const std::size_t looked : {16U, 17U, 60U, 300U, 10'000U}) {
    for (const Features& place : places) {
      for (const auto& [a, b] : {std::pair(&query, &place), std::pair(&place, &query)}) {
        verifier.match_strongest(*a, *b, looked, look);
        verifier.match(*a, *b, look, result);
        EXPECT_EQ(result.matches, match_features(*a, *b, 0.8)) << looked;
        verifier.match(*a, *b, result);
        EXPECT_EQ(result.matches, match_features(*a, *b, 0.8)) << looked;
      }
    }
  }
}

TEST(Verify, OtherSceneHasFewInliers) {
  const Features query = extract_surf(view(3));
  for (int scene = 4; scene < 12; ++scene) {
    EXPECT_LT(verify(query, extract_surf(view(scene))).inliers.size(), 12U) << scene;
  }
}

TEST(Verify, SeeksNoGeometryBelowMinMatches) {
  const Features query = extract_surf(view(2));
  const Features place = extract_surf(view(2, {12, 5}));
  const auto found = static_cast<int>(verify(query, place).matches.size());
  EXPECT_FALSE(verify(query, place, {.min_matches = found}).inliers.empty());
  const Verification few = verify(query, place, {.min_matches = found + 1});
  EXPECT_EQ(static_cast<int>(few.matches.size()), found);
  EXPECT_TRUE(few.inliers.empty());
}

TEST(Verify, FrameWithoutFeaturesHasNothing) {
  const Verification result = verify(extract_surf(view(2)), {});
  EXPECT_TRUE(result.matches.empty());
  EXPECT_TRUE(result.inliers.empty());
  EXPECT_EQ(result.distinct_inliers, 0);
}

TEST(Verify, RefusesOptionsOutOfRange) {
  expect_error(ErrorKind::option, {"verification.min_matches is 7", "8 and 1000"},
               [] { static_cast<void>(verify({}, {}, {.min_matches = 7})); });
}

TEST(Verify, TellsRealStereoPairsFromOthers) {
  LOOPBIT_NEEDS_DATA("kitti00_stereo");
  const std::vector<std::string> frames = {"000000", "001000", "002000"};
  for (const std::string& live : frames) {
    const Features query = extract_surf(real_image("kitti00_stereo/" + live + "_live.png"));
    for (const std::string& memory : frames) {
      const Features place = extract_surf(real_image("kitti00_stereo/" + memory + "_memory.png"));
      const std::size_t inliers = verify(query, place).inliers.size();
      if (live == memory) {
        EXPECT_GT(inliers, 100U) << live;
      } else {
        EXPECT_LT(inliers, 16U) << live << " and " << memory;
      }
    }
  }
}

TEST(MatchFeatures, EquallyNearDescriptorsAreAmbiguous) {
  Descriptor d{};
  d[3] = 9;
  const Features query{{}, 1, {{}}, {d}};
  const Features place{{}, 2, {{}, {}}, {d, d}};
  EXPECT_TRUE(match_features(query, place, 0.8).empty());
}

TEST(Verify, APictureMatchesItself) {
  for (int scene = 0; scene < 6; ++scene) {
    const Features features = extract_surf(view(scene));
    const Verification result = verify(features, features);
    EXPECT_GT(result.matches.size(), 100U);
    EXPECT_EQ(result.inliers, result.matches) << scene;
  }
}

}  // namespace
}  // namespace loopbit::test
