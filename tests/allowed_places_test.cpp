// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Places that a SLAM system leaves out, removes or rejects.
#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "loopbit/loop_detector.hpp"

#include "known_loops.hpp"
#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kPlacesOfLap = 24;

cv::Mat1b seen_again(int place) { return view(place, {6, 2}); }

LoopDetector after_a_lap() {
  LoopDetector detector(fast_options());
  for (int place = 0; place < kPlacesOfLap; ++place) detector.process(view(place));
  return detector;
}

struct RankedAnswer {
  Detection detection;
  std::vector<RankedPlace> ranking;
};

RankedAnswer ask(const LoopDetector& detector, const cv::Mat& image,
                 const AllowedPlaces& allowed = {}) {
  RankedAnswer answer;
  answer.detection = detector.query(image, std::nullopt, &answer.ranking, nullptr, allowed);
  return answer;
}

void expect_same_ranking(const RankedAnswer& a, const RankedAnswer& b) {
  EXPECT_EQ(a.detection.status, b.detection.status);
  EXPECT_EQ(a.detection.match, b.detection.match);
  EXPECT_EQ(a.detection.score, b.detection.score);
  ASSERT_EQ(a.ranking.size(), b.ranking.size());
  for (std::size_t i = 0; i < a.ranking.size(); ++i) {
    EXPECT_EQ(a.ranking[i].place, b.ranking[i].place) << i;
    EXPECT_EQ(a.ranking[i].score, b.ranking[i].score) << i;
  }
}

bool is_even(const SessionFrame& place) { return place.frame % 2 == 0; }

TEST(AllowedPlaces, RestrictTheCandidatesOfOneFrame) {
  LoopDetector detector = after_a_lap();
  EXPECT_EQ(detector.query(seen_again(5)).match, 5);
  const RankedAnswer answer = ask(detector, seen_again(5), is_even);
  EXPECT_FALSE(answer.ranking.empty());
  for (const RankedPlace& ranked : answer.ranking) EXPECT_TRUE(is_even(ranked.place));
  EXPECT_NE(answer.detection.status, Status::loop);
  EXPECT_EQ(ask(detector, seen_again(6), is_even).detection.match, 6);

  const auto none = [](const SessionFrame& /*place*/) { return false; };
  EXPECT_EQ(detector.process(seen_again(6), std::nullopt, nullptr, none).status,
            Status::no_similar_place);
  EXPECT_EQ(detector.process(seen_again(7)).match, 7);
}

TEST(AllowedPlaces, AListIsAsGoodAsAFunction) {
  const LoopDetector detector = after_a_lap();
  std::vector<SessionFrame> even{{0, 900}, {3, 2}, {0, -2}};  // those that do not exist are ignored
  for (int frame = kPlacesOfLap; frame >= 0; frame -= 2) even.push_back({0, frame});
  for (int place = 4; place < 8; ++place) {
    expect_same_ranking(ask(detector, seen_again(place), is_even),
                        ask(detector, seen_again(place), std::span<const SessionFrame>(even)));
  }
  const std::vector<SessionFrame> empty;
  EXPECT_TRUE(ask(detector, seen_again(4), std::span(empty)).ranking.empty());
  const std::function<bool(const SessionFrame&)> no_function;
  expect_same_ranking(ask(detector, seen_again(4), no_function), ask(detector, seen_again(4)));
}

TEST(RemovedPlaces, AreLeftOutAsIfTheyWereNotAllowed) {
  const LoopDetector whole = after_a_lap();
  LoopDetector culled = after_a_lap();
  for (int frame = 1; frame < kPlacesOfLap; frame += 2) {
    culled.remove({0, frame});
    culled.remove({0, frame});
  }
  EXPECT_EQ(culled.size(), kPlacesOfLap);
  for (int place = 0; place < kPlacesOfLap - 11; ++place) {
    const RankedAnswer answer = ask(culled, seen_again(place));
    expect_same_ranking(answer, ask(whole, seen_again(place), is_even));
    EXPECT_EQ(answer.detection.status == Status::loop, place % 2 == 0) << place;
  }
  const auto not_ten = [](const SessionFrame& place) { return place.frame != 10; };
  EXPECT_NE(ask(culled, seen_again(10), not_ten).detection.status, Status::loop);
}

TEST(RemovedPlaces, AreNeverMatchedAlongAFollowedWay) {
  LoopDetector detector = after_a_lap();
  for (int frame = 5; frame < 9; ++frame) detector.remove({0, frame});
  for (int place = 0; place < 12; ++place) {
    const Detection detection = detector.process(seen_again(place));
    EXPECT_EQ(detection.status == Status::loop, place < 5 || place > 8) << place;
    EXPECT_FALSE(detection.match >= 5 && detection.match < 9) << place;
  }
}

TEST(RemovedPlaces, AreNoRivals) {
  // Three places with the same left half, too recent to be taken for one, and a query with it.
  const auto half_alike = [](int scene) {
    cv::Mat1b picture = view(scene).clone();
    const cv::Rect left(0, 0, picture.cols / 2, picture.rows);
    view(100)(left).copyTo(picture(left));
    return picture;
  };
  LoopDetectorOptions options = fast_options();
  options.exclusion.frames = 30;
  LoopDetector detector(options);
  for (int place = 0; place < 60; ++place) {
    detector.process(place % 10 == 5 && place < 30 ? half_alike(place) : view(place));
  }
  const Detection among_three = detector.query(half_alike(90));
  ASSERT_NE(among_three.status, Status::loop);
  for (const int place : {5, 15, 25}) {
    if (place != among_three.match) detector.remove({0, place});
  }
  const Detection alone = detector.query(half_alike(90));
  EXPECT_EQ(alone.status, Status::loop);
  EXPECT_EQ(alone.match, among_three.match);
  EXPECT_GT(alone.score, 1.5 * among_three.score);
}

TEST(RemovedPlaces, DoNotCutOffTheRecentView) {
  // A camera that passes along one scene, most of which stays in view.
  const cv::Mat1b scene = textured_image({60 * 8 + 320, 240}, 1);
  LoopDetector whole(fast_options());
  LoopDetector culled(fast_options());
  for (int frame = 0; frame < 60; ++frame) {
    const cv::Mat1b image = scene(cv::Rect(frame * 8, 0, 320, 240));
    const Detection detection = culled.process(image);
    EXPECT_EQ(detection.status == Status::no_earlier_place,
              whole.process(image).status == Status::no_earlier_place)
        << frame;
    EXPECT_NE(detection.status, Status::loop) << frame;
    culled.remove({0, frame});
  }
}

TEST(RemovedPlaces, MustExist) {
  LoopDetector detector = after_a_lap();
  expect_error(ErrorKind::option, {"no frame 24", "has 24"}, [&] { detector.remove({0, 24}); });
  expect_error(ErrorKind::option, {"no frame -1"}, [&] { detector.remove({0, -1}); });
  expect_error(ErrorKind::option, {"session 1, frame 3"}, [&] { detector.remove({1, 3}); });
}

TEST(RejectedLoops, AreNotFoundAgainWhileTheViewStays) {
  LoopDetector detector = after_a_lap();
  const Detection loop = detector.process(seen_again(3));
  ASSERT_EQ(loop.match, 3);
  ASSERT_EQ(detector.query(seen_again(3)).match, 3);
  detector.reject(loop);
  for (int i = 0; i < 3; ++i) EXPECT_NE(detector.process(seen_again(3)).status, Status::loop);
  EXPECT_EQ(detector.process(seen_again(9)).match, 9);
  EXPECT_EQ(detector.process(seen_again(3)).match, 3) << "another visit may be right";
}

TEST(RejectedLoops, SupportNoLaterMatch) {
  LoopDetector detector = after_a_lap();
  const double alone = after_a_lap().query(seen_again(4)).score;
  const Detection loop = detector.process(seen_again(3));
  EXPECT_GT(detector.query(seen_again(4)).score, alone);
  detector.reject({0, loop.frame}, {0, *loop.match});
  EXPECT_LE(detector.query(seen_again(4)).score, alone);
}

TEST(RejectedLoops, MustBeOfFramesThatExist) {
  LoopDetector detector = after_a_lap();
  expect_error(ErrorKind::option, {"no frame 30"}, [&] { detector.reject({0, 30}, {0, 2}); });
  expect_error(ErrorKind::option, {"no frame 31"}, [&] { detector.reject({0, 20}, {0, 31}); });
  expect_error(ErrorKind::option, {"Frame 7 has no match"},
               [&] { detector.reject(Detection{.frame = 7}); });
}

TEST(RejectedLoops, AreForgottenWithAllThatFollowedFromThem) {
  KnownLoops loops;
  loops.add(100, 20);
  loops.add(200, 100);
  EXPECT_EQ(loops.first_visit(202), 20);
  loops.remove(100, 21);
  EXPECT_EQ(loops.first_visit(100), 20);
  loops.remove(100, 20);
  EXPECT_EQ(loops.first_visit(100), 100);
  EXPECT_EQ(loops.first_visit(202), 100);
}

TEST(Query, GivesTheEvidenceThatProcessGives) {
  LoopDetector detector = after_a_lap();
  Evidence asked;
  std::vector<RankedPlace> ranking;
  const Detection query = detector.query(seen_again(3), std::nullopt, &ranking, &asked);
  Evidence evidence;
  const Detection processed = detector.process(seen_again(3), std::nullopt, &evidence);
  EXPECT_EQ(query.match, processed.match);
  EXPECT_EQ(static_cast<int>(asked.inliers.size()), query.inliers);
  EXPECT_FALSE(asked.inliers.empty());
  EXPECT_EQ(asked.inliers, evidence.inliers);
  EXPECT_EQ(asked.content, evidence.content);
  EXPECT_EQ(cv::countNonZero(asked.saliency != evidence.saliency), 0);
}

}  // namespace
}  // namespace loopbit::test
