// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/surf.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "loopbit/verification.hpp"

#include "test_support.hpp"

namespace loopbit::test {
namespace {

/// Features in the pixels of `gray` itself.
Features extract_unscaled(const cv::Mat1b& gray, int max_keypoints = 400, bool upright = true) {
  return extract_surf(gray, {.working_area_px = gray.cols * gray.rows,
                             .max_keypoints = max_keypoints,
                             .upright = upright});
}

std::vector<std::tuple<float, float, float>> places_of(const Features& features, std::size_t first,
                                                       std::size_t count) {
  std::vector<std::tuple<float, float, float>> places;
  for (std::size_t i = first; i < first + count; ++i) {
    const Keypoint& k = features.keypoints.at(i);
    places.emplace_back(k.x_px, k.y_px, k.scale);
  }
  return places;
}

cv::Point2f at(const Keypoint& keypoint) { return {keypoint.x_px, keypoint.y_px}; }

/// The share of `matches` that `move` takes from the query's to within `tolerance_px` of the
/// place's keypoint.
template <typename Move>
int count_right(const Features& query, const Features& place, const std::vector<Match>& matches,
                double tolerance_px, Move&& move) {
  return static_cast<int>(std::count_if(matches.begin(), matches.end(), [&](const Match& match) {
    const cv::Point2f expected = move(at(query.keypoints[static_cast<std::size_t>(match.query)]));
    const cv::Point2f found = at(place.keypoints[static_cast<std::size_t>(match.place)]);
    return cv::norm(expected - found) <= tolerance_px;
  }));
}

void expect_consistent(const Features& features) {
  EXPECT_EQ(features.keypoints.size(), features.descriptors.size());
  EXPECT_LE(features.num_dark, features.keypoints.size());
  for (const Keypoint& keypoint : features.keypoints) {
    EXPECT_TRUE(cv::Rect2f({0, 0}, cv::Size2f(features.working_size_px)).contains(at(keypoint)));
    EXPECT_GT(keypoint.scale, 0);
  }
}

TEST(Surf, IsDeterministic) {
  const cv::Mat1b gray = view(1);
  const Features a = extract_surf(gray);
  const Features b = extract_surf(gray.clone());
  ASSERT_GT(a.keypoints.size(), 100U);
  EXPECT_EQ(a.num_dark, b.num_dark);
  EXPECT_EQ(a.descriptors, b.descriptors);
  EXPECT_EQ(places_of(a, 0, a.keypoints.size()), places_of(b, 0, b.keypoints.size()));
}

TEST(Surf, ReadsPartOfAnImage) {
  const cv::Mat1b part = textured_image({400, 300}, 2)(cv::Rect(31, 17, 231, 173));
  EXPECT_EQ(extract_unscaled(part).descriptors, extract_unscaled(part.clone()).descriptors);
}

/// Everything to the last bit.
void expect_same(const Features& a, const Features& b) {
  EXPECT_EQ(a.working_size_px, b.working_size_px);
  EXPECT_EQ(a.num_dark, b.num_dark);
  EXPECT_EQ(a.descriptors, b.descriptors);
  ASSERT_EQ(a.keypoints.size(), b.keypoints.size());
  EXPECT_EQ(places_of(a, 0, a.keypoints.size()), places_of(b, 0, b.keypoints.size()));
  for (std::size_t i = 0; i < a.keypoints.size(); ++i) {
    EXPECT_EQ(a.keypoints[i].angle_rad, b.keypoints[i].angle_rad);
  }
}

Features extract_with(InstructionSet set, const cv::Mat1b& gray, const SurfOptions& options) {
  Features features;
  SurfExtractor(options, set).extract(gray, features);
  return features;
}

TEST(Surf, EveryKernelFindsTheSameFeatures) {
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(333, 251), cv::Size(129, 640),
                              cv::Size(640, 97), cv::Size(64, 64), cv::Size(65, 71)}) {
    const cv::Mat1b gray = textured_image(size, size.width);
    for (const bool upright : {true, false}) {
      const SurfOptions options{.working_area_px = size.area(), .upright = upright};
      const Features expected = extract_with(InstructionSet::scalar, gray, options);
      for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(std::string(to_string(set)));
        expect_same(extract_with(set, gray, options), expected);
      }
    }
  }
}

TEST(Surf, EveryKernelFindsTheSameFeaturesInRealImages) {
  for (const std::string folder : {"kitti03", "corridor_loop", "euroc_room", "lateral_corridor"}) {
    LOOPBIT_NEEDS_DATA(folder);
    for (const std::size_t index : {0U, 33U, 66U}) {
      const cv::Mat1b gray = real_image(folder + "/images", index);
      const Features expected = extract_with(InstructionSet::scalar, gray, {});
      EXPECT_GT(expected.keypoints.size(), 100U);
      for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(std::string(to_string(set)));
        expect_same(extract_with(set, gray, {}), expected);
      }
    }
  }
}

TEST(Surf, ExtractorForgetsTheImageBefore) {
  SurfExtractor extractor;
  Features features;
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(200, 640), cv::Size(640, 193),
                              cv::Size(32, 32), cv::Size(640, 480)}) {
    const cv::Mat1b gray = textured_image(size, 12);
    extractor.extract(gray, features);
    expect_same(features, extract_surf(gray));
  }
}

TEST(Surf, FeaturesOfAFrameTakeAtMost48KilobytesByDefault) {
  const std::size_t bytes = sizeof(Keypoint) + sizeof(Descriptor);
  EXPECT_LE(static_cast<std::size_t>(SurfOptions().max_keypoints) * bytes, 48U * 1024U);
}

TEST(Surf, KeypointsAreSpreadOverTheImage) {
  // One corner of the image is full of strong blobs, the rest has faint ones.
  cv::Mat1b gray = textured_image({640, 480}, 13);
  cv::Mat faint;
  gray.convertTo(faint, CV_8U, 0.2, 100);
  gray(cv::Rect(0, 0, 320, 240)).copyTo(faint(cv::Rect(0, 0, 320, 240)));
  const Features features = extract_unscaled(faint, 300);
  const auto in_corner =
      std::count_if(features.keypoints.begin(), features.keypoints.end(),
                    [](const Keypoint& k) { return k.x_px < 320 && k.y_px < 240; });
  EXPECT_EQ(features.keypoints.size(), 300U);
  EXPECT_LT(in_corner, 260);
}

TEST(Surf, ShiftedCopyMatchesAtThatShift) {
  const cv::Point moved(16, -8);
  const Features query = extract_unscaled(view(3));
  const Features place = extract_unscaled(view(3, moved));
  const auto matches = match_features(query, place, 0.8);
  ASSERT_GT(matches.size(), 100U);
  const int right = count_right(query, place, matches, 1.0,
                                [&](cv::Point2f p) { return p - cv::Point2f(moved); });
  EXPECT_GT(right, 0.9 * static_cast<double>(matches.size()));
}

/// A lone disc of the radius 8 px at (100, 60).
cv::Mat1b disc_image(int ground, int disc) {
  cv::Mat1b image(160, 240, static_cast<std::uint8_t>(ground));
  cv::circle(image, {100, 60}, 8, disc, cv::FILLED, cv::LINE_AA);
  return image;
}

TEST(Surf, DarkDiscIsADarkKeypoint) {
  const Features features = extract_unscaled(disc_image(200, 50));
  ASSERT_GT(features.num_dark, 0U);
  EXPECT_NEAR(features.keypoints.front().x_px, 100, 1.5);
  EXPECT_NEAR(features.keypoints.front().y_px, 60, 1.5);
}

TEST(Surf, BrightDiscIsABrightKeypoint) {
  const Features features = extract_unscaled(disc_image(50, 200));
  ASSERT_LT(features.num_dark, features.keypoints.size());
  EXPECT_NEAR(features.keypoints.at(features.num_dark).x_px, 100, 1.5);
  EXPECT_NEAR(features.keypoints.at(features.num_dark).y_px, 60, 1.5);
}

TEST(Surf, NegativeSwapsDarkAndBright) {
  const cv::Mat1b gray = view(4);
  const cv::Mat negative = 255 - gray;
  const Features features = extract_unscaled(gray);
  const Features swapped = extract_unscaled(negative);
  const std::size_t bright = features.keypoints.size() - features.num_dark;
  ASSERT_NE(bright, features.num_dark);
  EXPECT_EQ(swapped.num_dark, bright);
  EXPECT_EQ(places_of(swapped, 0, bright), places_of(features, features.num_dark, bright));
}

TEST(Surf, StrongestComesFirst) {
  cv::Mat1b image(180, 240, 128);
  cv::circle(image, {60, 60}, 8, 100, cv::FILLED, cv::LINE_AA);
  cv::circle(image, {160, 60}, 8, 20, cv::FILLED, cv::LINE_AA);
  cv::circle(image, {60, 110}, 8, 250, cv::FILLED, cv::LINE_AA);
  cv::circle(image, {160, 110}, 8, 170, cv::FILLED, cv::LINE_AA);
  const Features features = extract_unscaled(image);
  ASSERT_GT(features.num_dark, 1U);
  ASSERT_LT(features.num_dark, features.keypoints.size());
  EXPECT_LT(cv::norm(at(features.keypoints.front()) - cv::Point2f(160, 60)), 1.5);
  EXPECT_LT(cv::norm(at(features.keypoints.at(features.num_dark)) - cv::Point2f(60, 110)), 1.5);
}

TEST(Surf, SmallerBudgetKeepsTheStrongestOfEachSign) {
  const Features many = extract_unscaled(view(5), 200);
  const Features few = extract_unscaled(view(5), 80);
  ASSERT_EQ(many.keypoints.size(), 200U);
  ASSERT_EQ(few.keypoints.size(), 80U);
  const std::size_t bright = 80 - few.num_dark;
  EXPECT_EQ(places_of(few, 0, few.num_dark), places_of(many, 0, few.num_dark));
  EXPECT_EQ(places_of(few, few.num_dark, bright), places_of(many, many.num_dark, bright));
}

TEST(Surf, KeypointsAreInPixelsOfTheWorkingImage) {
  for (const cv::Size size : {cv::Size(480, 320), cv::Size(120, 80)}) {
    const Features features = extract_surf(disc_image(200, 50), {.working_area_px = size.area()});
    const double factor = size.width / 240.0;
    EXPECT_EQ(features.working_size_px, size);
    ASSERT_GT(features.num_dark, 0U);
    EXPECT_NEAR(features.keypoints.front().x_px, 100 * factor, 1.5 * factor);
    EXPECT_NEAR(features.keypoints.front().y_px, 60 * factor, 1.5 * factor);
  }
}

/// How many of `keypoints` have one of `others` within `max_px`.
double num_near(const std::vector<Keypoint>& keypoints, const std::vector<Keypoint>& others,
                double max_px) {
  const auto near =
      std::count_if(keypoints.begin(), keypoints.end(), [&](const Keypoint& keypoint) {
        return std::any_of(others.begin(), others.end(), [&](const Keypoint& other) {
          return cv::norm(at(keypoint) - at(other)) <= max_px;
        });
      });
  return static_cast<double>(near);
}

TEST(Surf, ScalesImagesAsOpenCVDoes) {
  struct Case {
    cv::Size size;
    cv::InterpolationFlags interpolation;
  };
  for (const auto& [size, interpolation] :
       {Case{{512, 384}, cv::INTER_LINEAR_EXACT}, Case{{752, 480}, cv::INTER_LINEAR_EXACT},
        Case{{1242, 375}, cv::INTER_LINEAR_EXACT}, Case{{1920, 1080}, cv::INTER_AREA}}) {
    const cv::Mat1b gray = textured_image(size, 3);
    const Features scaled_here = extract_surf(gray);
    cv::Mat1b scaled;
    cv::resize(gray, scaled, scaled_here.working_size_px, 0, 0, interpolation);
    const Features expected =
        extract_surf(scaled, {.working_area_px = static_cast<int>(scaled.total())});
    ASSERT_EQ(expected.working_size_px, scaled_here.working_size_px);
    EXPECT_GT(num_near(scaled_here.keypoints, expected.keypoints, 0.2),
              0.9 * static_cast<double>(expected.keypoints.size()))
        << size;
  }
}

TEST(Surf, ImagesOfAllShapesAreScaledToTheSameArea) {
  EXPECT_EQ(extract_surf(textured_image({1242, 375}, 1)).working_size_px, cv::Size(1009, 305));
  EXPECT_EQ(extract_surf(textured_image({375, 1242}, 1)).working_size_px, cv::Size(305, 1009));
  EXPECT_EQ(extract_surf(textured_image({40000, 32}, 1)).working_size_px, cv::Size(16384, 13));
  EXPECT_EQ(extract_surf(textured_image({160, 120}, 1)).working_size_px, cv::Size(640, 480));
}

TEST(Surf, SameSceneInAnotherSizeMatches) {
  const cv::Mat1b gray = textured_image({640, 480}, 6);
  cv::Mat half;
  cv::resize(gray, half, {320, 240}, 0, 0, cv::INTER_AREA);
  const Features query = extract_surf(half);
  const Features place = extract_surf(gray);
  const auto matches = match_features(query, place, 0.8);
  ASSERT_GT(matches.size(), 100U);
  EXPECT_GT(count_right(query, place, matches, 3.0, [](cv::Point2f p) { return p; }),
            0.9 * static_cast<double>(matches.size()));
}

TEST(Surf, ScalingDownAveragesNoise) {
  Random random;
  const cv::Mat1b clean = textured_image({1280, 960}, 6);
  const SurfOptions quarter{.working_area_px = 320 * 240, .max_keypoints = 200};
  const Features place = extract_surf(clean, quarter);
  const Features query = extract_surf(with_noise(clean, 40.0, random), quarter);
  EXPECT_GT(count_right(query, place, match_features(query, place, 0.8), 2.0,
                        [](cv::Point2f p) { return p; }),
            150);
}

TEST(Surf, FlatImageHasNoFeatures) {
  for (const int level : {0, 128, 255}) {
    const Features features = extract_surf(cv::Mat1b(240, 320, static_cast<std::uint8_t>(level)));
    EXPECT_TRUE(features.keypoints.empty());
    EXPECT_EQ(features.num_dark, 0U);
  }
}

TEST(Surf, SmallestAndNarrowestImagesAreFine) {
  for (const cv::Size size :
       {cv::Size(32, 32), cv::Size(32, 33), cv::Size(4000, 32), cv::Size(32, 4000)}) {
    SCOPED_TRACE(size);
    expect_consistent(extract_surf(textured_image(size, 7)));
    expect_consistent(extract_surf(textured_image(size, 7), {.working_area_px = 64 * 64}));
  }
}

TEST(Surf, UprightFeaturesHaveNoAngle) {
  const Features upright = extract_unscaled(view(8), 200, true);
  const Features rotated = extract_unscaled(view(8), 200, false);
  std::set<float> angles;
  for (const Keypoint& keypoint : upright.keypoints) EXPECT_EQ(keypoint.angle_rad, 0);
  for (const Keypoint& keypoint : rotated.keypoints) angles.insert(keypoint.angle_rad);
  EXPECT_GT(angles.size(), 100U);
}

/// Right matches between a view and the same turned by 30 degrees.
int right_matches_when_turned(bool upright) {
  const cv::Mat1b gray = view(9);
  const cv::Matx23d turn = cv::getRotationMatrix2D({160, 120}, 30, 1.0);
  cv::Mat turned;
  cv::warpAffine(gray, turned, turn, gray.size(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, 128);
  const Features query = extract_unscaled(gray, 400, upright);
  const Features place = extract_unscaled(turned, 400, upright);
  return count_right(query, place, match_features(query, place, 0.8), 3.0, [&](cv::Point2f p) {
    const cv::Vec2d moved = turn * cv::Vec3d(p.x, p.y, 1);
    return cv::Point2f(static_cast<float>(moved[0]), static_cast<float>(moved[1]));
  });
}

TEST(Surf, RotatedFeaturesFollowATurnedImage) {
  const int rotated = right_matches_when_turned(false);
  const int upright = right_matches_when_turned(true);
  EXPECT_GT(rotated, 60);
  EXPECT_GT(rotated, 2 * upright);
}

/// An image turned about its middle, whole, with grey around it, and what turned it.
std::pair<cv::Mat1b, cv::Matx23d> turned_by(double degrees, const cv::Mat1b& gray) {
  const int side = cvCeil(std::hypot(gray.cols, gray.rows));
  cv::Matx23d turn =
      cv::getRotationMatrix2D(cv::Point2f(cv::Size2f(gray.size()) / 2.0F), degrees, 1);
  turn(0, 2) += (side - gray.cols) / 2.0;
  turn(1, 2) += (side - gray.rows) / 2.0;
  cv::Mat1b turned;
  cv::warpAffine(gray, turned, turn, {side, side}, cv::INTER_LINEAR, cv::BORDER_CONSTANT, 128);
  return {turned, turn};
}

TEST(Surf, BlobsAndDirectionsTurnWithTheImage) {
  std::size_t keypoints = 0;
  std::vector<double> errors_deg;  // of the directions of those found in both images
  for (const double degrees : {20.0, 45.0, 75.0}) {
    const cv::Mat1b gray = view(9);
    const auto [turned, turn] = turned_by(degrees, gray);
    const Features before = extract_unscaled(gray, 400, false);
    const Features after = extract_unscaled(turned, 400, false);
    keypoints += before.keypoints.size();
    for (const Keypoint& keypoint : before.keypoints) {
      const cv::Vec2d moved = turn * cv::Vec3d(keypoint.x_px, keypoint.y_px, 1);
      const auto distance_px = [&](const Keypoint& other) {
        return std::hypot(other.x_px - moved[0], other.y_px - moved[1]);
      };
      const auto nearest = std::min_element(
          after.keypoints.begin(), after.keypoints.end(),
          [&](const auto& a, const auto& b) { return distance_px(a) < distance_px(b); });
      if (distance_px(*nearest) > 2) continue;
      const double turned_rad = keypoint.angle_rad - nearest->angle_rad;
      errors_deg.push_back(std::abs(std::remainder(turned_rad * 180 / CV_PI - degrees, 360)));
    }
  }
  // Without smoothing, 65 % are found again.
  EXPECT_GT(errors_deg.size() * 100, keypoints * 72);
  // With wavelets of 4 x 4 scales and rounded edges, half the errors are larger than 3.4 degrees.
  std::sort(errors_deg.begin(), errors_deg.end());
  EXPECT_LT(errors_deg[errors_deg.size() / 2], 2.9);
}

TEST(Surf, DimImageKeepsMostKeypoints) {
  const cv::Mat1b gray = view(10);
  const Features bright = extract_unscaled(gray);
  for (const auto& [contrast, share] : {std::pair{1.0 / 4, 0.7}, {1.0 / 16, 0.6}}) {
    cv::Mat dim;
    gray.convertTo(dim, CV_8U, contrast);
    const Features faint = extract_unscaled(dim);
    EXPECT_GT(num_near(bright.keypoints, faint.keypoints, 2.0),
              share * static_cast<double>(bright.keypoints.size()))
        << contrast;
  }
}

TEST(Surf, DescriptorsHaveUnitLengthTimesTheirScale) {
  for (const Descriptor& descriptor : extract_unscaled(view(11)).descriptors) {
    const double length = std::sqrt(
        std::inner_product(descriptor.begin(), descriptor.end(), descriptor.begin(), 0.0));
    // Less where a value above 0.5 was cut off.
    EXPECT_LT(length, 254 * 1.02);
    EXPECT_GT(length, 254 * 0.75);
  }
}

TEST(Surf, RefusesImagesThatAreTooSmall) {
  expect_error(ErrorKind::input, {"empty", "32 x 32"}, [] { extract_surf(cv::Mat1b()); });
  expect_error(ErrorKind::input, {"500 x 31", "32 x 32"},
               [] { extract_surf(cv::Mat1b(31, 500, std::uint8_t{9})); });
}

TEST(Surf, RefusesOptionsOutOfRange) {
  expect_error(ErrorKind::option, {"surf.max_keypoints is 49", "50 and 10000"},
               [] { extract_surf(view(0), {.max_keypoints = 49}); });
}

}  // namespace
}  // namespace loopbit::test
