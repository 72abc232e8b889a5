// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"
#include "loopbit/world.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kLap = 24;

/// Only the frame just before is too recent.
LoopDetectorOptions short_window_options() {
  LoopDetectorOptions options = fast_options();
  options.exclusion.min_frames = 1;
  options.exclusion.frames = 1;
  return options;
}

/// A place seen again, from a little beside.
cv::Mat1b again(int place) { return view(place, {6, 2}); }

/// A detector that has passed the places first to last.
LoopDetector after_places(int first, int last, const LoopDetectorOptions& options) {
  LoopDetector detector(options);
  for (int place = first; place <= last; ++place) detector.process(view(place));
  return detector;
}

/// A robot that passes kLap different places and then the same again.
std::vector<cv::Mat1b> two_laps() {
  std::vector<cv::Mat1b> images;
  images.reserve(std::size_t{2} * kLap);
  Random random;
  for (int place = 0; place < kLap; ++place) images.push_back(view(place));
  for (int place = 0; place < kLap; ++place) {
    images.push_back(with_noise(again(place), 3.0, random));
  }
  return images;
}

std::vector<Detection> process_all(LoopDetector& detector, const std::vector<cv::Mat1b>& images) {
  std::vector<Detection> detections;
  detections.reserve(images.size());
  for (const cv::Mat1b& image : images) detections.push_back(detector.process(image));
  return detections;
}

void expect_same_answer(const Detection& a, const Detection& b) {
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.timestamp_s, b.timestamp_s);
  EXPECT_EQ(a.status, b.status) << "of frame " << a.frame;
  EXPECT_EQ(a.match, b.match) << "of frame " << a.frame;
  EXPECT_EQ(a.score, b.score) << "of frame " << a.frame;
  EXPECT_EQ(a.similarity, b.similarity);
  EXPECT_EQ(a.matches, b.matches);
  EXPECT_EQ(a.inliers, b.inliers);
  const auto expect_same = [](const std::vector<LateLoop>& x, const std::vector<LateLoop>& y) {
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      EXPECT_EQ(x[i].frame, y[i].frame);
      EXPECT_EQ(x[i].match, y[i].match);
      EXPECT_EQ(x[i].score, y[i].score);
    }
  };
  expect_same(a.late_loops, b.late_loops);
  expect_same(a.withdrawn_loops, b.withdrawn_loops);
}

void expect_same_answers(const std::vector<Detection>& a, const std::vector<Detection>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) expect_same_answer(a[i], b[i]);
}

/// What holds for any detection.
void expect_consistent(const Detection& detection, const LoopDetectorOptions& options) {
  SCOPED_TRACE(detection.frame);
  const bool loop = detection.status == Status::loop;
  EXPECT_EQ(loop, detection.score >= options.decision.min_score);
  EXPECT_LE(detection.inliers, detection.matches);
  EXPECT_GE(detection.score, 0);
  EXPECT_LE(detection.score, 1 + 1e-9);
  if (detection.match) {
    EXPECT_GE(*detection.match, 0);
    EXPECT_LT(*detection.match, detection.frame - options.exclusion.min_frames);
    EXPECT_GT(detection.similarity, 0);
  }
  const bool verified =
      loop || detection.status == Status::few_matches || detection.status == Status::no_geometry ||
      detection.status == Status::low_score || detection.status == Status::ambiguous;
  EXPECT_EQ(detection.match.has_value(), verified);
}

TEST(LoopDetector, FindsTheLoopsOfASecondLapAndNoOthers) {
  LoopDetector detector(fast_options());
  const auto detections = process_all(detector, two_laps());
  for (int frame = 0; frame < kLap; ++frame) {
    EXPECT_NE(detections[static_cast<std::size_t>(frame)].status, Status::loop) << frame;
  }
  for (int frame = kLap; frame < 2 * kLap; ++frame) {
    const Detection& detection = detections[static_cast<std::size_t>(frame)];
    EXPECT_EQ(detection.status, Status::loop) << frame;
    EXPECT_EQ(detection.match, frame - kLap);
  }
  for (const Detection& detection : detections) expect_consistent(detection, detector.options());
}

TEST(LoopDetector, NumbersFramesAndMeasuresTime) {
  LoopDetector detector(fast_options());
  EXPECT_EQ(detector.size(), 0);
  for (int frame = 0; frame < 3; ++frame) {
    const Detection detection = detector.process(view(frame), 0.5 * frame);
    EXPECT_EQ(detection.frame, frame);
    EXPECT_EQ(detection.timestamp_s, 0.5 * frame);
    EXPECT_GT(detection.times.content_ms, 0);
    EXPECT_GT(detection.times.features_ms, 0);
    EXPECT_GE(detection.times.retrieval_ms, 0);
    EXPECT_GE(detection.times.verification_ms, 0);
    EXPECT_EQ(detector.size(), frame + 1);
  }
}

TEST(LoopDetector, FirstFramesHaveNoEarlierPlace) {
  LoopDetector detector(fast_options());
  for (int frame = 0; frame <= 10; ++frame) {
    EXPECT_EQ(detector.process(view(frame)).status, Status::no_earlier_place) << frame;
  }
  EXPECT_NE(detector.process(view(11)).status, Status::no_earlier_place);
}

TEST(LoopDetector, SameImagesGiveTheSameAnswers) {
  const auto images = two_laps();
  LoopDetector one(fast_options());
  LoopDetector other(fast_options());
  expect_same_answers(process_all(one, images), process_all(other, images));
}

TEST(LoopDetector, QueryAnswersAsProcessAndAddsNothing) {
  LoopDetector asked(fast_options());
  LoopDetector not_asked(fast_options());
  for (const cv::Mat1b& image : two_laps()) {
    const Detection query = asked.query(image);
    const Detection again = asked.query(image);
    const Detection processed = asked.process(image);
    expect_same_answer(query, processed);
    expect_same_answer(again, processed);
    expect_same_answer(not_asked.process(image), processed);
  }
}

/// Of a view of `place` that shares little with it: half of it is covered.
cv::Mat1b half_covered(int place) {
  cv::Mat1b image = again(place);
  image(cv::Rect(0, 0, 170, 240)) = 128;
  return image;
}

TEST(LoopDetector, FramesBeforeSupportALoop) {
  for (const int window : {0, 15}) {
    LoopDetectorOptions options = fast_options();
    options.exclusion.frames = window;
    LoopDetector detector = after_places(0, kLap - 1, options);
    const double alone = detector.query(half_covered(2)).score;
    detector.process(half_covered(0));
    detector.process(half_covered(1));
    EXPECT_GT(detector.query(half_covered(2)).score, alone) << window;
  }
}

TEST(LoopDetector, StandingStillAddsNoEvidence) {
  LoopDetector detector = after_places(0, kLap - 1, fast_options());
  // While it stands here, all places of the lap become candidates.
  for (int i = 0; i < 16; ++i) detector.process(view(50));
  ASSERT_EQ(detector.process(half_covered(3)).match, 3);
  const Detection first = detector.process(half_covered(3));
  EXPECT_LT(first.score, 0.9999) << "or there is nothing to add to";
  for (int i = 0; i < 3; ++i) {
    const Detection next = detector.process(half_covered(3));
    EXPECT_EQ(next.match, first.match);
    EXPECT_EQ(next.score, first.score);
  }
}

TEST(LoopDetector, MinScoreItselfIsEnough) {
  LoopDetectorOptions options = short_window_options();
  const Detection loop = after_places(1, 12, options).query(again(1));
  ASSERT_EQ(loop.status, Status::loop);
  options.decision.min_score = loop.score;
  expect_same_answer(after_places(1, 12, options).query(again(1)), loop);

  options.decision.min_score = std::nextafter(loop.score, 2.0);
  const Detection rejected = after_places(1, 12, options).query(again(1));
  EXPECT_EQ(rejected.status, Status::low_score);
  EXPECT_EQ(rejected.match, loop.match);
  EXPECT_EQ(rejected.score, loop.score);
}

TEST(LoopDetector, SkippedFramesSayNothingOfThePlacesBesideThem) {
  constexpr int kStepPx = 20;
  constexpr int kFrames = 30;
  const cv::Mat1b scene = textured_image({kFrames * kStepPx + 320, 240}, 1);
  const auto passing_view = [&](int frame) {
    return scene(cv::Rect(frame * kStepPx, 0, 320, 240)).clone();
  };
  LoopDetectorOptions options = fast_options();
  options.exclusion.frames = kFrames;
  LoopDetector detector(options);
  for (int frame = 0; frame < kFrames; ++frame) {
    frame == 15 ? detector.skip() : detector.process(passing_view(frame));
  }
  for (int frame = 0; frame < kFrames; ++frame) detector.process(view(50 + frame));
  for (const int frame : {13, 14, 16, 17}) {
    EXPECT_EQ(detector.query(passing_view(frame)).match, frame);
  }
}

/// Loops of a second lap of which only the first frame looks exactly as it did.
int loops_after_one_that_looks_alike(const LoopDetectorOptions& options) {
  LoopDetector detector = after_places(0, 20, options);
  EXPECT_EQ(detector.process(view(2)).match, 2);
  int loops = 0;
  for (int place = 3; place < 14; ++place) {
    const Detection detection = detector.process(again(place));
    expect_consistent(detection, options);
    if (detection.status != Status::loop) continue;
    EXPECT_EQ(detection.match, place);
    ++loops;
  }
  return loops;
}

TEST(LoopDetector, FollowsAWayWherePlacesDoNotLookAlike) {
  LoopDetectorOptions options = short_window_options();
  options.retrieval.min_similarity = 1.0;
  EXPECT_EQ(loops_after_one_that_looks_alike(options), 11);
}

TEST(LoopDetector, AFirstLookPutsTheRightCandidateFirst) {
  LoopDetectorOptions options = short_window_options();
  options.verification.max_closer_looks = 1;
  const LoopDetector detector = after_places(0, 40, options);
  for (int place = 0; place < 40; place += 3) {
    const Detection detection = detector.query(again(place));
    EXPECT_EQ(detection.status, Status::loop) << place;
    EXPECT_EQ(detection.match, place);
  }
}

TEST(LoopDetector, AFirstLookFindsAsManyLoopsInRealImages) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  LoopDetectorOptions thorough;
  thorough.verification.max_closer_looks = 1000;
  LoopDetector quick_detector;
  LoopDetector thorough_detector(thorough);
  int loops = 0;
  int thorough_loops = 0;
  for (std::size_t frame = 0; frame < 84; ++frame) {
    const cv::Mat1b image = real_image("corridor_loop/images", frame);
    const Detection a = quick_detector.process(image);
    const Detection b = thorough_detector.process(image);
    if (a.status == Status::loop && b.status == Status::loop) {
      EXPECT_NEAR(*a.match, *b.match, 3);
    }
    loops += a.status == Status::loop ? 1 : 0;
    thorough_loops += b.status == Status::loop ? 1 : 0;
  }
  EXPECT_GT(loops, 30);
  EXPECT_GE(loops, thorough_loops - 1);
}

// Masks

/// Of a real image with a bonnet over its lowest 72 rows, the pixels that are not the bonnet.
cv::Mat1b bonnet_mask() {
  cv::Mat1b mask(384, 512, 255);
  mask.rowRange(312, 384) = 0;
  return mask;
}

/// The same bonnet in all images, under light that changes.
cv::Mat1b with_bonnet(const cv::Mat1b& image, int frame) {
  cv::Mat1b picture = image.clone();
  cv::Mat1b bonnet;
  textured_image({512, 72}, 1000).convertTo(bonnet, CV_8U, frame % 2 == 0 ? 1.0 : 0.7);
  bonnet.copyTo(picture.rowRange(312, 384));
  return picture;
}

TEST(LoopDetector, NothingIsFoundUnderAMaskInRealImages) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  LoopDetector masked;
  masked.set_mask(bonnet_mask());
  int loops = 0;
  std::size_t num_features = 0;
  for (int frame = 0; frame < 84; ++frame) {
    const cv::Mat1b image = real_image("corridor_loop/images", static_cast<std::size_t>(frame));
    Evidence evidence;
    const Detection detection = masked.process(with_bonnet(image, frame), std::nullopt, &evidence);
    for (std::size_t row = 52; row < 64; ++row) EXPECT_EQ(evidence.content.rows[row], 0U);
    const Features features = masked.features_of({0, frame});
    num_features += features.keypoints.size();
    const float top_px = 312.0F * static_cast<float>(features.working_size_px.height) / 384.0F;
    for (const Keypoint& keypoint : features.keypoints) EXPECT_LT(keypoint.y_px, top_px);
    const bool is_loop = detection.status == Status::loop;
    loops += is_loop ? 1 : 0;
    EXPECT_TRUE(!is_loop || frame >= 40) << "a wrong loop of frame " << frame;
  }
  EXPECT_GT(loops, 25);
  EXPECT_GT(num_features, std::size_t{84} * 100);
}

/// A place behind something that travels along and moves in the image.
cv::Mat1b view_behind_companion(int place, const cv::Point& moved_px, Random& random) {
  cv::Mat1b image = view(place, moved_px);
  const cv::Rect at(random.between(80, 110), random.between(70, 100), 120, 110);
  cv::resize(textured_image(at.size() * 2, 1000), image(at), at.size(), 0, 0, cv::INTER_AREA);
  return image;
}

TEST(LoopDetector, FindsLoopsBehindACompanion) {
  LoopDetector detector(fast_options());
  Random random;
  constexpr int kPlaces = 100;
  for (int place = 0; place < kPlaces; ++place) {
    const Detection detection = detector.process(view_behind_companion(place, {0, 0}, random));
    EXPECT_NE(detection.status, Status::loop) << place;
  }
  int loops = 0;
  for (int place = 0; place < kPlaces - 20; ++place) {
    const Detection detection = detector.process(view_behind_companion(place, {6, 2}, random));
    if (detection.status != Status::loop) continue;
    EXPECT_EQ(detection.match, place);
    ++loops;
  }
  EXPECT_GE(loops, kPlaces / 2);
}

TEST(LoopDetector, AMaskThatExcludesNothingChangesNothing) {
  const std::vector<cv::Mat1b> images = two_laps();
  LoopDetector plain(fast_options());
  LoopDetector masked(fast_options());
  masked.set_mask(cv::Mat1b(images[0].size(), 1));
  const auto expected = process_all(plain, images);
  const auto found = process_all(masked, images);
  for (std::size_t i = 0; i < images.size(); ++i) expect_same_answer(found[i], expected[i]);
  LoopDetector unmasked(fast_options());
  cv::Mat1b left_half(images[0].size(), std::uint8_t{255});
  left_half.colRange(left_half.cols / 2, left_half.cols) = 0;
  unmasked.set_mask(left_half);
  unmasked.set_mask(cv::Mat());
  const auto without = process_all(unmasked, images);
  for (std::size_t i = 0; i < images.size(); ++i) expect_same_answer(without[i], expected[i]);
}

TEST(LoopDetector, AnImagePreparedBeforeGetsTheSameAnswer) {
  const std::vector<cv::Mat1b> images = two_laps();
  cv::Mat1b mask(images[0].size(), 255);
  mask.colRange(0, 60) = 0;
  LoopDetector expected(fast_options());
  LoopDetector preparing(fast_options());
  for (LoopDetector* masked : {&expected, &preparing}) masked->set_mask(mask);
  std::vector<PreparedImage> prepared;
  prepared.reserve(images.size());
  for (const cv::Mat& image : images) prepared.push_back(preparing.prepare(image));
  EXPECT_EQ(preparing.size(), 0);
  LoopDetector detector(fast_options());
  int loops = 0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    Evidence of_image;
    Evidence of_prepared;
    std::vector<RankedPlace> ranking;
    std::vector<RankedPlace> expected_ranking;
    expect_same_answer(detector.query(prepared[i], std::nullopt, &ranking),
                       expected.query(images[i], std::nullopt, &expected_ranking));
    EXPECT_TRUE(std::ranges::equal(ranking, expected_ranking, [](const auto& a, const auto& b) {
      return a.place == b.place && a.score == b.score && a.inliers == b.inliers;
    }));
    const Detection answer = expected.process(images[i], std::nullopt, &of_image);
    const Detection found =
        detector.process(std::move(prepared[i]), std::nullopt, std::nullopt, &of_prepared);
    expect_same_answer(found, answer);
    EXPECT_GT(found.times.content_ms, 0);
    EXPECT_GT(found.times.features_ms, 0);
    EXPECT_EQ(of_prepared.content, of_image.content);
    EXPECT_EQ(of_prepared.saliency.size(), cv::Size(kContentSide, kContentSide));
    EXPECT_EQ(cv::norm(of_prepared.saliency, of_image.saliency, cv::NORM_INF), 0.0);
    EXPECT_EQ(of_prepared.inliers, of_image.inliers);
    loops += answer.status == Status::loop ? 1 : 0;
  }
  EXPECT_GT(loops, kLap / 2);
  expect_error(ErrorKind::input, {"31 x 31"},
               [&] { (void)detector.prepare(cv::Mat1b(31, 31, 5)); });
}

TEST(LoopDetector, FeaturesMustBeWhole) {
  const Features whole = extract_surf(view(1));
  std::vector<Features> broken(5, whole);
  broken[0].num_dark = whole.keypoints.size() + 1;
  broken[1].keypoints.pop_back();
  broken[2].working_size_px = {};
  broken[3].keypoints.resize(40000);
  broken[3].descriptors.resize(40000);
  broken[4] = {};
  broken[4].working_size_px = {640, -480};
  LoopDetector detector(fast_options());
  for (const Features& features : broken) {
    expect_error(ErrorKind::input, {"keypoints", "not whole"},
                 [&] { detector.process(BinaryContent{}, features); });
  }
  EXPECT_EQ(detector.size(), 0);
  detector.process(BinaryContent{}, whole);
  EXPECT_EQ(detector.size(), 1);
}

TEST(LoopDetector, AMaskThatDoesNotFitIsRefused) {
  LoopDetector detector(fast_options());
  cv::Mat1b mask(240, 320, std::uint8_t{0});
  expect_error(ErrorKind::option, {"excludes the whole image", "0 of its 76800 pixels"},
               [&] { detector.set_mask(mask); });
  mask(9, 9) = 255;
  expect_error(ErrorKind::option, {"excludes the whole image", "1 of its 76800 pixels"},
               [&] { detector.set_mask(mask); });
  expect_error(ErrorKind::option, {"CV_16UC1", "8 bits"},
               [&] { detector.set_mask(cv::Mat1w::ones(240, 320)); });
  detector.set_mask(cv::Mat1b(120, 160, 255));
  expect_error(ErrorKind::input, {"320 x 240", "mask has 160 x 120"},
               [&] { detector.process(view(0)); });
  EXPECT_EQ(detector.size(), 0);
  detector.set_mask(cv::Mat1b(240, 320, 255));
  EXPECT_EQ(detector.process(view(0)).frame, 0);
}

// Cameras

TEST(LoopDetector, ACameraThatDoesNotFitIsRefused) {
  LoopDetector detector(fast_options());
  CameraModel camera{.fx = 300, .fy = 300, .cx = 160, .cy = 120};
  expect_error(ErrorKind::input, {"set_camera()", "size_px"}, [&] { detector.set_camera(camera); });
  camera.size_px = {640, 480};
  camera.fy = -1;
  expect_error(ErrorKind::input, {"set_camera()", "-1"}, [&] { detector.set_camera(camera); });
  camera.fy = 300;
  detector.set_camera(camera);
  expect_error(ErrorKind::input, {"set_camera()", "640 x 480", "320 x 240"},
               [&] { detector.process(view(0)); });
  EXPECT_EQ(detector.size(), 0);
  camera.size_px = {320, 240};
  detector.set_camera(camera);
  EXPECT_EQ(detector.process(view(0)).frame, 0);
}

TEST(LoopDetector, ACameraThatIsTakenBackChangesNothing) {
  const std::vector<cv::Mat1b> images = two_laps();
  LoopDetector plain(fast_options());
  LoopDetector taken_back(fast_options());
  taken_back.set_camera(
      CameraModel{.size_px = {640, 480}, .fx = 600, .fy = 600, .cx = 320, .cy = 240});
  taken_back.set_camera(std::nullopt);
  const auto expected = process_all(plain, images);
  const auto found = process_all(taken_back, images);
  for (std::size_t i = 0; i < images.size(); ++i) expect_same_answer(found[i], expected[i]);
}

/// Loops of a drive through a town, and wrong ones.
std::pair<int, int> loops_of(const World& world, const std::vector<cv::Mat>& images,
                             const std::optional<CameraModel>& camera) {
  const std::vector<PlaceRun> right = world.near_place();
  LoopDetector detector;
  detector.set_camera(camera);
  int loops = 0;
  int wrong = 0;
  for (const cv::Mat& image : images) {
    const Detection detection = detector.process(image);
    if (detection.status != Status::loop) continue;
    ++loops;
    const bool is_right = std::ranges::any_of(right, [&](const PlaceRun& run) {
      return run.query == detection.frame && run.first <= *detection.match &&
             *detection.match <= run.last;
    });
    wrong += is_right ? 0 : 1;
  }
  return {loops, wrong};
}

TEST(LoopDetector, ACameraFindsMoreThroughAFisheye) {
  WorldOptions options;
  options.frames = 130;
  options.laps = 2;
  options.spacing_m = 1.8;
  options.lateral_offset_m = 3;
  options.light_change = 1;
  options.width_px = 320;
  options.height_px = 240;
  options.fisheye_deg = 150;
  const World world(options);
  std::vector<cv::Mat> images;
  for (int frame = 0; frame < options.frames; ++frame) images.push_back(world.render(frame));
  const auto [without, wrong_without] = loops_of(world, images, std::nullopt);
  const auto [with, wrong_with] = loops_of(world, images, world.camera(0));
  EXPECT_GT(without, 0);
  EXPECT_GT(with, without);
  EXPECT_EQ(wrong_with, 0);
  EXPECT_EQ(wrong_without, 0);
}

// Places that look alike

/// A picture of `scene` with the left half of `common`.
cv::Mat1b half_shared(int scene, int common) {
  cv::Mat1b picture = view(scene).clone();
  const cv::Rect left(0, 0, picture.cols / 2, picture.rows);
  view(common)(left).copyTo(picture(left));
  return picture;
}

/// Of a new place that shares its left half with as many earlier places, which came too soon after
/// each other to be taken for one.
Detection of_a_look_alike(int num_places) {
  LoopDetectorOptions options = fast_options();
  options.exclusion.frames = 30;
  LoopDetector detector(options);
  for (int place = 0; place < 60; ++place) {
    const bool is_alike = place % 10 == 5 && place < 10 * num_places;
    detector.process(is_alike ? half_shared(place, 100) : view(place));
  }
  return detector.process(half_shared(90, 100));
}

TEST(LoopDetector, InliersThatManyPlacesShareCountLess) {
  const Detection one = of_a_look_alike(1);
  const Detection three = of_a_look_alike(3);
  EXPECT_EQ(one.status, Status::loop) << "one look-alike place alone cannot be told from a revisit";
  EXPECT_NE(three.status, Status::loop);
  EXPECT_LT(three.score, 0.6 * one.score);
}

TEST(LoopDetector, LapsThroughOnePlaceAreNotAmbiguous) {
  LoopDetector detector(fast_options());
  for (int lap = 0; lap < 4; ++lap) {
    for (int place = 0; place < kLap; ++place) {
      const Detection detection = detector.process(view(place, {2 * lap, 0}));
      EXPECT_EQ(detection.status == Status::loop, lap > 0) << lap << ", " << place;
    }
  }
}

TEST(LoopDetector, PresetCountsMatchesAlone) {
  LoopDetectorOptions options = short_window_options();
  options.decision = {.min_score = 30, .count_matches = true};
  const Detection detection = after_places(0, 5, options).query(again(3));
  EXPECT_EQ(detection.status, Status::loop);
  EXPECT_EQ(detection.match, 3);
  EXPECT_EQ(detection.score, detection.matches);
  EXPECT_EQ(detection.inliers, 0);
}

TEST(LoopDetector, OdometryGoesWithAnyNumberOfCandidates) {
  LoopDetectorOptions options = fast_options();
  options.retrieval.max_candidates = kMaxCandidates;
  LoopDetector detector(options);
  const Detection detection = detector.process(view(0), std::nullopt, OdometryPose{});
  EXPECT_EQ(detection.status, Status::no_earlier_place);
}

// Frames without a usable image

TEST(LoopDetector, SkippedFrameCountsAndIsNeverAMatch) {
  LoopDetector detector(fast_options());
  const auto images = two_laps();
  for (int frame = 0; frame < 2 * kLap; ++frame) {
    if (frame == 5 || frame == kLap + 8) {
      const Detection skipped = detector.skip(1.5);
      EXPECT_EQ(skipped.frame, frame);
      EXPECT_EQ(skipped.timestamp_s, 1.5);
      EXPECT_EQ(skipped.status, Status::unreadable);
      EXPECT_FALSE(skipped.match);
      continue;
    }
    const Detection detection = detector.process(images[static_cast<std::size_t>(frame)]);
    EXPECT_EQ(detection.frame, frame);
    EXPECT_NE(detection.match, 5) << frame;
    // Where the path goes on through a place that was skipped, it may match the one beside it.
    if (frame == kLap + 5) continue;
    EXPECT_EQ(detection.status == Status::loop, frame >= kLap) << frame;
  }
  EXPECT_EQ(detector.size(), 2 * kLap);
}

TEST(LoopDetector, OnlySkippedFramesAreNoPlaces) {
  LoopDetector detector(fast_options());
  for (int frame = 0; frame < 30; ++frame) detector.skip();
  const Detection detection = detector.process(view(1));
  EXPECT_EQ(detection.frame, 30);
  EXPECT_FALSE(detection.match);
}

TEST(LoopDetector, UnusableImageThrowsAndChangesNothing) {
  LoopDetector detector(fast_options());
  LoopDetector undisturbed(fast_options());
  for (const cv::Mat1b& image : two_laps()) {
    EXPECT_THROW(detector.process(cv::Mat()), Error);
    EXPECT_THROW(detector.process(cv::Mat1b(31, 31, 5)), Error);
    EXPECT_THROW(detector.process(cv::Mat1f(100, 100, 5)), Error);
    EXPECT_THROW(static_cast<void>(detector.query(cv::Mat())), Error);
    EXPECT_EQ(detector.size(), undisturbed.size());
    expect_same_answer(detector.process(image), undisturbed.process(image));
  }
  expect_error(ErrorKind::input, {"31 x 31"}, [&] { detector.process(cv::Mat1b(31, 31, 5)); });
}

// The sanitizers take memory of their own.
#ifndef LOOPBIT_SANITIZED
/// Refuses memory in large pieces while it lives.
class LittleMemory {
 public:
  LittleMemory() {
    constexpr std::size_t kMore_bytes = std::size_t{20} << 20U;
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    getrlimit(RLIMIT_AS, &before_);
    const rlimit limit{pages * static_cast<std::size_t>(getpagesize()) + kMore_bytes,
                       before_.rlim_max};
    setrlimit(RLIMIT_AS, &limit);
  }
  ~LittleMemory() { setrlimit(RLIMIT_AS, &before_); }
  LittleMemory(const LittleMemory&) = delete;
  LittleMemory& operator=(const LittleMemory&) = delete;
  LittleMemory(LittleMemory&&) = delete;
  LittleMemory& operator=(LittleMemory&&) = delete;

 private:
  rlimit before_{};
};

TEST(LoopDetector, WhereMemoryForPlacesIsRefusedNothingChanges) {
  LoopDetector undisturbed(fast_options());
  LoopDetector detector(fast_options());
  static_cast<void>(detector.query(view(0)));  // what it works in is there
  {
    const LittleMemory little;
    EXPECT_THROW(detector.process(view(0)), std::bad_alloc);
    EXPECT_THROW(detector.skip(), std::bad_alloc);
  }
  EXPECT_EQ(detector.size(), 0);
  expect_same_answers(process_all(detector, two_laps()), process_all(undisturbed, two_laps()));
}
#endif

TEST(LoopDetector, BlankImagesAreNeverLoops) {
  LoopDetector detector = after_places(0, kLap - 1, fast_options());
  for (int frame = 0; frame < 20; ++frame) {
    const Detection detection = detector.process(cv::Mat1b(240, 320, 90));
    EXPECT_EQ(detection.status, Status::no_similar_place);
    EXPECT_FALSE(detection.match);
    EXPECT_EQ(detection.score, 0);
  }
  EXPECT_EQ(detector.process(again(3)).match, 3) << "blank frames hide no earlier place";
}

TEST(LoopDetector, UnrelatedImageSharesTooLittle) {
  const LoopDetector detector = after_places(0, kLap - 1, fast_options());
  for (int scene = 100; scene < 110; ++scene) {
    const Detection detection = detector.query(view(scene));
    EXPECT_NE(detection.status, Status::loop) << scene;
    expect_consistent(detection, detector.options());
  }
}

// What is too recent

TEST(LoopDetector, StandingStillIsNoLoop) {
  LoopDetector detector(fast_options());
  Random random;
  const cv::Mat1b scene = view(1);
  for (int frame = 0; frame < 200; ++frame) {
    EXPECT_EQ(detector.process(with_noise(scene, 4.0, random)).status, Status::no_earlier_place)
        << frame;
  }
}

TEST(LoopDetector, StandingStillInHeavyNoiseIsNoLoop) {
  LoopDetector detector(fast_options());
  Random random;
  const cv::Mat1b scene = view(1);
  for (int frame = 0; frame < 60; ++frame) {
    EXPECT_NE(detector.process(with_noise(scene, 40.0, random)).status, Status::loop) << frame;
  }
}

TEST(LoopDetector, DarkFramesWhileStandingStillMakeNoLoops) {
  LoopDetector detector(fast_options());
  Random random;
  const cv::Mat1b scene = view(1);
  const cv::Mat1b dark(scene.size(), uchar{0});
  for (int frame = 0; frame < 80; ++frame) {
    const bool is_covered = frame == 3 || frame % 20 == 19;
    const cv::Mat1b image = is_covered ? dark : with_noise(scene, 4.0, random);
    EXPECT_EQ(detector.process(image).status, Status::no_earlier_place) << frame;
  }
}

TEST(LoopDetector, PassingAlongOneSceneIsNoLoopUntilItIsSeenAgain) {
  constexpr int kStepPx = 16;
  constexpr int kFrames = 70;
  const cv::Mat1b scene = textured_image({kFrames * kStepPx + 320, 250}, 1);
  const auto passing_view = [&](int frame, cv::Point beside_px) {
    return scene(cv::Rect(cv::Point(frame * kStepPx, 0) + beside_px, cv::Size(320, 240))).clone();
  };
  LoopDetector detector(fast_options());
  for (int frame = 0; frame < kFrames; ++frame) {
    EXPECT_NE(detector.process(passing_view(frame, {0, 0})).status, Status::loop) << frame;
  }
  for (int frame = 0; frame < 10; ++frame) {
    const Detection detection = detector.process(passing_view(frame, {3, 5}));
    EXPECT_EQ(detection.status, Status::loop);
    // Views beside each other share nearly all of the scene, and the pace is not known at first.
    EXPECT_NEAR(detection.match.value_or(-100), frame, 2);
  }
}

TEST(LoopDetector, WindowFixedByFrames) {
  LoopDetectorOptions options = fast_options();
  options.exclusion = {.min_frames = 1, .frames = 4};
  EXPECT_EQ(after_places(0, 3, options).query(again(0)).status, Status::no_earlier_place);
  const LoopDetector detector = after_places(0, 4, options);
  EXPECT_EQ(detector.query(again(0)).match, 0);
  EXPECT_NE(detector.query(again(1)).match, 1);
}

TEST(LoopDetector, WindowIsNeverShorterThanMinFrames) {
  LoopDetectorOptions options = fast_options();
  options.exclusion = {.min_frames = 4, .frames = 1};
  EXPECT_EQ(after_places(0, 3, options).query(again(0)).status, Status::no_earlier_place);
  EXPECT_EQ(after_places(0, 4, options).query(again(0)).match, 0);

  options.exclusion = {.min_frames = 2, .seconds = 0.1};
  LoopDetector detector(options);
  detector.process(view(0), 0.0);
  detector.process(view(1), 1.0);
  EXPECT_EQ(detector.query(again(0), 2.0).status, Status::no_earlier_place);
  detector.process(view(2), 2.0);
  EXPECT_EQ(detector.query(again(0), 3.0).match, 0);
}

LoopDetectorOptions ten_seconds() {
  LoopDetectorOptions options = fast_options();
  options.exclusion = {.min_frames = 1, .seconds = 10.0};
  return options;
}

TEST(LoopDetector, WindowFixedBySeconds) {
  LoopDetector detector(ten_seconds());
  detector.process(view(0), 100.0);
  detector.process(view(1), 100.0);  // two frames may have one time
  detector.process(view(2), 105.0);
  detector.process(view(3), 106.0);
  EXPECT_EQ(detector.query(again(0), 109.9).status, Status::no_earlier_place);
  for (const PlaceId place : {0, 1}) {
    const Detection detection = detector.query(again(place), 110.0);
    EXPECT_EQ(detection.match, place);
  }
  EXPECT_NE(detector.query(again(2), 114.9).match, 2);
  EXPECT_EQ(detector.query(again(2), 115.0).match, 2);
}

TEST(LoopDetector, MissingOrBackwardTimeThrowsAndChangesNothing) {
  LoopDetector detector(ten_seconds());
  EXPECT_THROW(detector.process(view(0)), Error);
  EXPECT_EQ(detector.size(), 0);
  detector.process(view(0), 100.0);
  detector.process(view(1), 101.0);
  expect_error(ErrorKind::input, {"Frame 2", "timestamp", "exclusion.seconds is 10"},
               [&] { detector.process(view(2)); });
  expect_error(ErrorKind::input, {"Frame 2", "100.5", "101"},
               [&] { detector.process(view(2), 100.5); });
  expect_error(ErrorKind::input, {"Frame 2"},
               [&] { detector.process(view(2), std::numeric_limits<double>::quiet_NaN()); });
  EXPECT_THROW(static_cast<void>(detector.query(view(2))), Error);
  EXPECT_EQ(detector.size(), 2);
  EXPECT_EQ(detector.process(again(0), 110.0).match, 0) << "the refused times left no trace";
}

TEST(LoopDetector, SkippedFrameNeedsNoTime) {
  LoopDetector detector(ten_seconds());
  detector.skip();
  detector.process(view(0), 100.0);
  detector.skip();
  detector.skip(50.0);
  EXPECT_EQ(detector.size(), 4);
  EXPECT_EQ(detector.query(again(0), 109.9).status, Status::no_similar_place);
  EXPECT_EQ(detector.process(again(0), 110.0).match, 1);
}

TEST(LoopDetector, TheTimeOfASkippedFrameShutsNoneOut) {
  LoopDetector detector(ten_seconds());
  detector.skip(-10.0);
  detector.process(view(0), -9.0);
  detector.skip(1e18);
  EXPECT_EQ(detector.process(again(0), 2.0).match, 1);
}

TEST(LoopDetector, TimesDoNotMatterUnlessTheWindowIsInSeconds) {
  LoopDetector detector(short_window_options());
  detector.process(view(0), 100.0);
  detector.process(view(1), 50.0);
  detector.process(view(2));
  EXPECT_EQ(detector.process(again(0), 20.0).match, 0);
}

// The object

TEST(LoopDetector, RefusesOptionsOutOfRange) {
  LoopDetectorOptions options;
  options.decision.min_score = -1;
  expect_error(ErrorKind::option, {"decision.min_score is -1"}, [&] { LoopDetector{options}; });
  options = {};
  options.exclusion.frames = 1;
  options.exclusion.seconds = 1;
  expect_error(ErrorKind::option, {"exclusion.seconds"}, [&] { LoopDetector{options}; });
}

TEST(LoopDetector, KeepsItsOptions) {
  EXPECT_EQ(LoopDetector(ten_seconds()).options().exclusion.seconds, 10.0);
}

TEST(LoopDetector, MovesWithAllItKnows) {
  LoopDetector first = after_places(0, 19, short_window_options());
  LoopDetector second(std::move(first));
  EXPECT_EQ(second.size(), 20);
  EXPECT_EQ(second.query(again(0)).status, Status::loop);
  LoopDetector third;
  third = std::move(second);
  EXPECT_EQ(third.size(), 20);
  EXPECT_EQ(third.options().exclusion.frames, 1);
  EXPECT_EQ(third.query(again(0)).status, Status::loop);
}

TEST(LoopDetector, MovedFromCanBeAssignedAnew) {
  LoopDetector detector(fast_options());
  detector.process(view(0));
  const LoopDetector taken(std::move(detector));
  detector = LoopDetector(fast_options());
  EXPECT_EQ(detector.size(), 0);
  EXPECT_EQ(detector.process(view(1)).frame, 0);
  EXPECT_EQ(taken.size(), 1);
}

TEST(LoopDetector, TakesColourAnd16Bits) {
  const LoopDetector detector = after_places(0, 19, short_window_options());
  const cv::Mat1b gray = again(0);
  const Detection expected = detector.query(gray);
  ASSERT_EQ(expected.status, Status::loop);
  cv::Mat colour;
  cv::merge(std::vector<cv::Mat>{gray, gray, gray}, colour);
  expect_same_answer(detector.query(colour), expected);
  cv::Mat deep;
  gray.convertTo(deep, CV_16U, 16.0);
  EXPECT_EQ(detector.query(deep).status, Status::loop);
}

TEST(Status, HasItsNameInWords) {
  EXPECT_EQ(to_string(Status::loop), "loop");
  EXPECT_EQ(to_string(Status::no_earlier_place), "no_earlier_place");
  EXPECT_EQ(to_string(Status::no_similar_place), "no_similar_place");
  EXPECT_EQ(to_string(Status::few_matches), "few_matches");
  EXPECT_EQ(to_string(Status::no_geometry), "no_geometry");
  EXPECT_EQ(to_string(Status::low_score), "low_score");
  EXPECT_EQ(to_string(Status::unreadable), "unreadable");
}

TEST(LoopDetector, TheSamePicturesAgainAreLoops) {
  LoopDetector detector(fast_options());
  for (int place = 0; place < kLap; ++place) detector.process(view(place));
  for (int place = 0; place < kLap; ++place) {
    const Detection detection = detector.process(view(place));
    EXPECT_EQ(detection.status, Status::loop) << place;
    EXPECT_EQ(detection.match, place);
  }
}

TEST(LoopDetector, TimesThatAreNoNumbersAreRefusedFromTheStart) {
  LoopDetector detector(ten_seconds());
  EXPECT_THROW(detector.process(view(0), std::numeric_limits<double>::quiet_NaN()), Error);
  detector.skip(std::numeric_limits<double>::infinity());
  EXPECT_EQ(detector.process(view(0), 1.0).frame, 1);
}

}  // namespace
}  // namespace loopbit::test
