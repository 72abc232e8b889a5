// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A detector with a map: sessions, and what may not depend on there being one.
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "loopbit/loop_detector.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/surf.hpp"

#include "map_support.hpp"
#include "places.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kPlaces = 24;

class MapSession : public ScratchTest {
 protected:
  /// Passes the places first to last, seen from `moved_px` beside, in a session of its own.
  std::vector<Detection> drive(int first, int last, cv::Point moved_px = {0, 0},
                               const std::string& name = "map.db") {
    const auto map = std::make_shared<MapWriter>(path(name), fast_options(), "drive");
    LoopDetector detector(fast_options(), map);
    std::vector<Detection> detections;
    for (int place = first; place <= last; ++place) {
      detections.push_back(detector.process(view(place, moved_px)));
    }
    map->finish();
    return detections;
  }
};

/// A map in memory that another robot's session, recorded before, is added to.
class GrowingMap : public MapStorage {
 public:
  GrowingMap(const std::string& path, int session) {
    MapReader map(path);
    for (const MapPlace& place : places_of(map)) {
      theirs_.push_back({{session, place.at.frame},
                         place.content,
                         std::make_shared<Features>(*map.features_of(place))});
    }
  }

  /// The next `number` places are there from the beginning, or news.
  void reveal(std::size_t number, bool from_the_beginning) {
    (from_the_beginning ? earlier_ : known_) += number;
  }

  void tell(const MapNews::Loop& loop) { loops_.push_back(loop); }

  /// How often features were asked for.
  [[nodiscard]] int asked() const { return asked_; }

  void check_options(const LoopDetectorOptions& /*options*/) override {}
  void for_each_earlier_place(const Visit& visit) override {
    for (std::size_t i = 0; i < earlier_; ++i) visit(theirs_[i].at, theirs_[i].content);
    known_ = told_ = earlier_;
  }
  void for_each_earlier_loop(const VisitLoop& /*visit*/) override {}
  std::int64_t epoch() override { return 1; }
  MapNews news() override {
    MapNews news{.epoch = static_cast<std::int64_t>(1 + known_),
                 .loops = std::exchange(loops_, {})};
    for (; told_ < known_; ++told_)
      news.places.push_back({theirs_[told_].at, theirs_[told_].content});
    return news;
  }
  std::shared_ptr<const Features> features(PlaceId place) override {
    ++asked_;
    const auto number = static_cast<std::size_t>(place < 0 ? -(place + 1) : place);
    if (place < 0) return theirs_[earlier_ + number].features;
    return number < earlier_ ? theirs_[number].features : ours_[number - earlier_];
  }
  void add(const Detection& /*detection*/, const BinaryContent& /*content*/,
           std::shared_ptr<const Features> features, const cv::Mat& /*image*/) override {
    ours_.push_back(std::move(features));
  }
  void remove(PlaceId /*place*/) override {}
  void reject(const SessionFrame& /*query*/, const SessionFrame& /*match*/) override {}

 private:
  struct Theirs {
    SessionFrame at;
    BinaryContent content;
    std::shared_ptr<const Features> features;
  };

  std::vector<Theirs> theirs_;
  std::vector<std::shared_ptr<const Features>> ours_;
  std::vector<MapNews::Loop> loops_;
  std::size_t earlier_ = 0;
  std::size_t known_ = 0;
  std::size_t told_ = 0;
  int asked_ = 0;
};

TEST_F(MapSession, NewsBeforeTheFirstFrameIsAsAnEarlierSession) {
  drive(0, kPlaces - 1);
  std::vector<std::shared_ptr<GrowingMap>> maps;
  std::vector<LoopDetector> detectors;
  for (const bool from_the_beginning : {true, false}) {
    maps.push_back(std::make_shared<GrowingMap>(path("map.db"), 7));
    if (from_the_beginning) maps.back()->reveal(kPlaces, true);
    detectors.emplace_back(fast_options(), maps.back());
  }
  maps[1]->reveal(kPlaces, false);
  int loops = 0;
  // Later, its own places are candidates, too: those beside the others' last ones by number.
  for (int frame = 0; frame < kPlaces - 5; ++frame) {
    const cv::Mat1b image = view(5 + frame, {6, 2});
    const Detection before = detectors[0].process(image);
    const Detection news = detectors[1].process(image);
    EXPECT_EQ(news.status, before.status) << frame;
    EXPECT_EQ(news.earlier_match, before.earlier_match) << frame;
    EXPECT_EQ(news.match, before.match) << frame;
    EXPECT_EQ(news.score, before.score) << frame;
    EXPECT_EQ(news.similarity, before.similarity) << frame;
    EXPECT_EQ(news.epoch, 1 + kPlaces);
    loops += news.status == Status::loop && news.earlier_match.has_value();
  }
  EXPECT_GT(loops, kPlaces / 2);
}

TEST_F(MapSession, PlacesThatOthersAddMeanwhileAreRecognised) {
  drive(0, kPlaces - 1);
  const auto map = std::make_shared<GrowingMap>(path("map.db"), 7);
  LoopDetector detector(fast_options(), map);
  for (int place = 0; place < 6; ++place) {
    EXPECT_NE(detector.process(view(place, {6, 2})).status, Status::loop);
  }
  map->reveal(10, false);
  for (int place = 6; place < kPlaces; ++place) {
    if (place == 9) map->reveal(kPlaces - 10, false);
    const Detection found = detector.process(view(place, {6, 2}));
    EXPECT_EQ(found.status, Status::loop) << place;
    EXPECT_EQ(found.earlier_match, (SessionFrame{7, place}));
    EXPECT_EQ(found.epoch, place < 9 ? 11 : 1 + kPlaces);
  }
  const std::vector<SessionFrame> allowed{{7, 3}, {7, 20}};
  EXPECT_EQ(detector.query(view(3), std::nullopt, nullptr, nullptr, allowed).earlier_match,
            (SessionFrame{7, 3}));
  EXPECT_FALSE(detector.features_of({7, 3}).keypoints.empty());
  detector.remove({7, 3});
  EXPECT_NE(detector.query(view(3)).earlier_match, (SessionFrame{7, 3}));
  EXPECT_TRUE(detector.features_of({7, 3}).keypoints.empty());
  expect_error(ErrorKind::option, {"session 7, frame 99"}, [&] { detector.remove({7, 99}); });
}

TEST_F(MapSession, LoopsThatOthersFindTellLapsFromRivals) {
  drive(0, kPlaces - 1);
  std::vector<double> rivals;
  for (const bool tells : {false, true}) {
    const auto map = std::make_shared<GrowingMap>(path("map.db"), 7);
    LoopDetector detector(fast_options(), map);
    for (int place = 0; place < kPlaces; ++place) detector.process(view(place, {6, 2}));
    map->reveal(kPlaces, false);
    for (int place = 0; tells && place < kPlaces; ++place) map->tell({{7, place}, {0, place}});
    const Detection found = detector.process(view(4, {3, 1}));
    ASSERT_TRUE(found.terms.has_value());
    rivals.push_back(found.terms->rivals);
  }
  EXPECT_GT(rivals[1], rivals[0]);
}

TEST_F(MapSession, AMapChangesNothingWithinASession) {
  const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
  LoopDetector with(fast_options(), map);
  LoopDetector without(fast_options());
  int loops = 0;
  for (int frame = 0; frame < 2 * kPlaces; ++frame) {
    const cv::Mat1b image = view(frame % kPlaces, {frame < kPlaces ? 0 : 5, 0});
    const Detection a = with.process(image);
    const Detection b = without.process(image);
    EXPECT_EQ(a.frame, b.frame);
    EXPECT_EQ(a.status, b.status) << frame;
    EXPECT_EQ(a.match, b.match) << frame;
    EXPECT_EQ(a.score, b.score) << frame;
    EXPECT_FALSE(a.earlier_match.has_value());
    loops += a.status == Status::loop;
  }
  EXPECT_GT(loops, kPlaces / 2);
}

TEST_F(MapSession, AVeryNarrowImageIsAPlaceAsAnyOther) {
  const LoopDetectorOptions options;
  const cv::Mat1b narrow = textured_image({5800, 72}, 1);
  auto map = std::make_shared<MapWriter>(path("map.db"), options, "drive");
  LoopDetector(options, map).process(narrow);
  map->finish();
  map = std::make_shared<MapWriter>(path("map.db"), options, "drive");
  const Detection again = LoopDetector(options, map).process(narrow);
  EXPECT_EQ(again.earlier_match, (SessionFrame{1, 0}));
  EXPECT_GT(again.matches, 50);
}

TEST_F(MapSession, EarlierSessionsAreRecognisedFromTheFirstFrameOn) {
  drive(0, kPlaces - 1);
  const auto detections = drive(5, kPlaces - 1, {6, 2});
  for (const Detection& detection : detections) {
    EXPECT_EQ(detection.status, Status::loop) << detection.frame;
    ASSERT_TRUE(detection.earlier_match.has_value()) << detection.frame;
    EXPECT_EQ(*detection.earlier_match, (SessionFrame{1, detection.frame + 5}));
    EXPECT_FALSE(detection.match.has_value());
  }
  MapReader map(path("map.db"));
  ASSERT_EQ(map.loops().size(), detections.size());
  EXPECT_EQ(map.loops()[3].query, (SessionFrame{2, 3}));
  EXPECT_EQ(map.loops()[3].match, (SessionFrame{1, 8}));
}

TEST_F(MapSession, TheFirstFrameOfAMapHasNoEarlierPlace) {
  EXPECT_EQ(drive(0, kPlaces - 1).front().status, Status::no_earlier_place);
  EXPECT_EQ(drive(0, 0).front().status, Status::loop);
}

TEST_F(MapSession, TimesOfEarlierSessionsDoNotMatter) {
  LoopDetectorOptions options = fast_options();
  options.exclusion.seconds = 100;
  for (int session = 1; session <= 2; ++session) {
    const auto map = std::make_shared<MapWriter>(path("map.db"), options, "drive");
    LoopDetector detector(options, map);
    for (int place = 0; place < kPlaces; ++place) {
      const Detection detection = detector.process(view(place, {3, 0}), 5.0 + place);
      EXPECT_EQ(detection.status, session == 1 ? Status::no_earlier_place : Status::loop);
    }
  }
}

TEST_F(MapSession, WithAFixedWindowRemovedPlacesLeaveNoFeatures) {
  drive(0, 0);
  LoopDetectorOptions options = fast_options();
  options.exclusion.frames = 10;
  const auto map = std::make_shared<GrowingMap>(path("map.db"), 7);
  LoopDetector detector(options, map);
  for (int place = 0; place < kPlaces; ++place) detector.process(view(place));
  const int before = map->asked();
  detector.remove({0, 2});  // only the features of the latest change of view are kept
  EXPECT_EQ(map->asked(), before);
}

TEST_F(MapSession, QueriesRankThePlacesOfAllSessions) {
  drive(0, kPlaces - 1);
  drive(0, kPlaces - 1, {8, 0});
  const auto map = std::make_shared<MapReader>(path("map.db"));
  LoopDetector detector(fast_options(), map);
  std::vector<RankedPlace> places;
  const Detection detection = detector.query(view(7, {8, 1}), std::nullopt, &places);
  EXPECT_EQ(detection.status, Status::loop);
  ASSERT_GE(places.size(), 2U);
  EXPECT_EQ(places[0].place, (SessionFrame{2, 7}));
  EXPECT_EQ(places[1].place, (SessionFrame{1, 7}));
  EXPECT_EQ(places[0].score, detection.score);
  EXPECT_EQ(places[0].inliers, detection.inliers);
  EXPECT_EQ(detection.earlier_match, places[0].place);
  for (std::size_t i = 1; i < places.size(); ++i) EXPECT_GE(places[i - 1].score, places[i].score);
  EXPECT_EQ(detector.query(view(kPlaces + 3)).status == Status::loop, false);
  expect_error(ErrorKind::option, {path("map.db"), "MapWriter"},
               [&] { detector.process(view(1)); });
}

TEST_F(MapSession, AQueryOfTheSameSessionIsSessionZero) {
  LoopDetector detector(fast_options());
  for (int place = 0; place < kPlaces; ++place) detector.process(view(place));
  std::vector<RankedPlace> places;
  (void)detector.query(view(2, {4, 0}), std::nullopt, &places);
  ASSERT_FALSE(places.empty());
  EXPECT_EQ(places[0].place, (SessionFrame{0, 2}));
}

TEST_F(MapSession, PlacesWithoutTheirFeaturesAreNeverMatched) {
  drive(0, kPlaces - 1);
  change(path("map.db"), "DELETE FROM features WHERE place = 8");
  const auto map = std::make_shared<MapReader>(path("map.db"));
  const LoopDetector detector(map->options(), map);
  EXPECT_EQ(detector.query(view(8, {4, 0})).earlier_match, (SessionFrame{1, 8}));
  const Detection lost = detector.query(view(7, {4, 0}));
  EXPECT_NE(lost.status, Status::loop);
  EXPECT_EQ(map->damage().size(), 1U);
}

TEST_F(MapSession, ADetectorOfOtherSettingsIsRefused) {
  drive(0, 3);
  LoopDetectorOptions options = fast_options();
  options.decision.min_score = 1;  // shapes no place
  const auto map = std::make_shared<MapReader>(path("map.db"));
  const auto writer = std::make_shared<MapWriter>(path("new.db"), fast_options(), "drive");
  options.surf.max_keypoints = 200;
  for (const std::shared_ptr<MapStorage>& each : {std::shared_ptr<MapStorage>(map), {writer}}) {
    expect_error(ErrorKind::option,
                 {"surf.max_keypoints is 200", ".db", "made with surf.max_keypoints = 300"},
                 [&] { const LoopDetector detector(options, each); });
  }
  options.surf.max_keypoints = 300;
  EXPECT_EQ(LoopDetector(options, map).query(view(1)).status, Status::low_score);
  EXPECT_EQ(LoopDetector(options, writer).size(), 0);
}

TEST_F(MapSession, AMapServesOneDetector) {
  drive(0, kPlaces - 1);
  const auto reader = std::make_shared<MapReader>(path("map.db"));
  const LoopDetector asked(fast_options(), reader);
  expect_error(ErrorKind::option, {"map.db", "has a detector"},
               [&] { LoopDetector(fast_options(), reader); });
  const auto writer = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
  LoopDetector continued(fast_options(), writer);
  expect_error(ErrorKind::option, {"map.db", "has a detector"},
               [&] { LoopDetector(fast_options(), writer); });
  EXPECT_EQ(continued.process(view(9, {4, 0})).earlier_match, (SessionFrame{1, 9}));
}

TEST_F(MapSession, FeaturesFoundLostDuringASessionAreTold) {
  drive(0, kPlaces - 1);
  change(path("map.db"), "UPDATE features SET checksum = 0 WHERE place = 8");
  const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
  LoopDetector detector(fast_options(), map);
  EXPECT_TRUE(map->damage().empty());  // no features are read yet
  EXPECT_NE(detector.process(view(7, {4, 0})).status, Status::loop);
  EXPECT_EQ(detector.process(view(9, {4, 0})).earlier_match, (SessionFrame{1, 9}));
  map->finish();
  ASSERT_EQ(map->damage().size(), 1U);
  EXPECT_NE(map->damage()[0].find("place 8 (session 1, frame 7)"), std::string::npos);
  EXPECT_EQ(MapReader(path("map.db")).sessions().size(), 2U);
}

TEST_F(MapSession, FeaturesThatNoImageHasAreLeftOut) {
  const Features whole = extract_surf(view(1));
  std::vector<Features> strange(3, whole);
  strange[0].keypoints[0].x_px = 3e38F;
  strange[1].keypoints[0].scale = std::numeric_limits<float>::quiet_NaN();
  strange[2].working_size_px = {};
  MapWriter writer(path("map.db"), fast_options(), "drive");
  writer.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  writer.add({.frame = 0}, {}, std::make_shared<Features>(whole), {});
  for (int i = 0; i < 3; ++i) {
    writer.add({.frame = i + 1}, {},
               std::make_shared<Features>(strange[static_cast<std::size_t>(i)]), {});
  }
  writer.finish();
  MapReader map(path("map.db"));
  map.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  EXPECT_EQ(map.features(0)->keypoints.size(), whole.keypoints.size());
  for (const PlaceId place : {1, 2, 3})
    EXPECT_TRUE(map.features(place)->keypoints.empty()) << place;
  EXPECT_EQ(map.damage().size(), 3U);
}

TEST_F(MapSession, AFrameThatCouldNotBeReadIsNoDamage) {
  constexpr std::size_t kBytes = std::size_t{256} << 20U;  // of features that are kept in memory
  constexpr int kFrames = 4;
  auto large = std::make_shared<Features>();
  large->descriptors.resize(kBytes / kFrames / sizeof(Descriptor));
  large->keypoints.resize(large->descriptors.size());
  MapWriter map(path("map.db"), fast_options(), "drive");
  map.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  map.add({.frame = 0, .status = Status::unreadable}, {}, std::make_shared<Features>(), {});
  for (int frame = 1; frame <= kFrames; ++frame) map.add({.frame = frame}, {}, large, {});
  map.flush();
  EXPECT_TRUE(map.features(0)->keypoints.empty());
  EXPECT_EQ(map.damage(), std::vector<std::string>{});
}

TEST_F(MapSession, MatchesSupportEachOtherWithinASessionOnly) {
  const auto last_session = [&](const std::string& map, std::initializer_list<int> ends) {
    int first = 0;
    for (const int end : ends) {
      drive(first, end - 1, {0, 0}, map);
      first = end;
    }
    return drive(8, 16, {6, 2}, map);
  };
  const auto one = last_session("one.db", {kPlaces});
  const auto two = last_session("two.db", {12, kPlaces});
  // Frame 4 shows place 12, the first of the second session. What is known of wrong places and
  // how many steps there are differs a little.
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(one[i].score, two[i].score, 1e-4);
  EXPECT_EQ(two[4].earlier_match, (SessionFrame{2, 0}));
  EXPECT_LT(two[4].score, one[4].score);
  EXPECT_GT(two[8].score, two[4].score);
}

/// A bonnet in view does not make the first frames of two sessions one place.
TEST_F(MapSession, ARobotInViewIsNoPlace) {
  const auto view_over_bonnet = [](int place, const cv::Point& moved_px) {
    cv::Mat1b image = view(place, moved_px);
    const cv::Rect lowest(0, 3 * image.rows / 4, image.cols, image.rows / 4);
    cv::resize(textured_image({2 * lowest.width, 2 * lowest.height}, 99), image(lowest),
               lowest.size(), 0, 0, cv::INTER_AREA);
    return image;
  };
  const auto drive_past = [&](const std::vector<int>& places, const cv::Point& moved_px) {
    const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
    LoopDetector detector(fast_options(), map);
    std::vector<int> found;
    for (const int place : places) {
      const Detection detection = detector.process(view_over_bonnet(place, moved_px));
      if (detection.status != Status::loop) continue;
      EXPECT_EQ(detection.earlier_match, (SessionFrame{1, place}));
      found.push_back(place);
    }
    map->finish();
    return found;
  };
  std::vector<int> first(100);
  std::iota(first.begin(), first.end(), 0);
  drive_past(first, {0, 0});
  EXPECT_EQ(drive_past({100, 101, 102, 103, 104, 8, 9, 10, 11}, {6, 2}),
            (std::vector{8, 9, 10, 11}));
}

TEST_F(MapSession, StepsAreCountedFromTheBeginningOfEachSession) {
  drive(0, 6);
  drive(7, 9);
  const Places places(fast_options(), std::make_shared<MapReader>(path("map.db")));
  std::vector<std::ptrdiff_t> steps;
  for (PlaceId place = 0; place < places.size(); ++place) {
    steps.push_back(places.steps_into_session(place));
  }
  EXPECT_EQ(steps, (std::vector<std::ptrdiff_t>{0, 1, 2, 3, 4, 5, 6, 0, 1, 2}));
}

TEST_F(MapSession, StepsOfNewsAreCountedFromTheFirst) {
  drive(0, 6);
  const auto map = std::make_shared<GrowingMap>(path("map.db"), 7);
  Places places(fast_options(), map);
  map->reveal(3, false);
  places.learn();
  for (const PlaceId place : {-1, -2, -3}) EXPECT_EQ(places.steps_into_session(place), -1 - place);
}

TEST_F(MapSession, RemovedPlacesStayRemoved) {
  drive(0, kPlaces - 1);
  {
    const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
    LoopDetector detector(fast_options(), map);
    detector.remove({1, 7});
    for (int place = 0; place < kPlaces; ++place) {
      const Detection detection = detector.process(view(place, {4, 0}));
      EXPECT_NE(detection.earlier_match, (SessionFrame{1, 7})) << place;
      EXPECT_EQ(detection.earlier_match == (SessionFrame{1, place}), place != 7) << place;
    }
    detector.remove({0, 7});   // no other place shows its scene now
    detector.remove({0, 23});  // still in view, and perhaps not yet committed
    map->finish();
  }
  EXPECT_EQ(places_of(path("map.db")).size(), std::size_t{2} * kPlaces - 3);
  EXPECT_EQ(check_map(path("map.db")).damage, std::vector<std::string>{});
  const auto map = std::make_shared<MapReader>(path("map.db"));
  const LoopDetector detector(fast_options(), map);
  EXPECT_NE(detector.query(view(7, {2, 0})).status, Status::loop);
  EXPECT_EQ(detector.query(view(23, {2, 0})).earlier_match, (SessionFrame{1, 23}));
  EXPECT_EQ(map->damage(), std::vector<std::string>{});
}

TEST_F(MapSession, RejectedLoopsStayRejected) {
  drive(0, kPlaces - 1);
  MapLoop wrong;
  {
    const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
    LoopDetector detector(fast_options(), map);
    for (int place = 5; place < 15; ++place) {
      const Detection loop = detector.process(view(place, {6, 2}));
      ASSERT_EQ(loop.earlier_match, (SessionFrame{1, place}));
      if (place != 9) continue;
      wrong = {{2, loop.frame}, *loop.earlier_match, loop.score,
               loop.similarity, loop.matches,        loop.inliers};
      detector.reject(loop);
      detector.reject(loop);
    }
    expect_error(ErrorKind::option, {"map.db", "no session 7"}, [&] {
      detector.reject({7, 1}, {1, 2});
    });
    map->finish();
  }
  MapReader map(path("map.db"));
  EXPECT_EQ(map.loops().size(), 9U);
  for (const MapLoop& loop : map.loops()) EXPECT_NE(loop.query.frame, wrong.query.frame);
  EXPECT_EQ(map.rejected_loops(), std::vector<MapLoop>{wrong});
  EXPECT_EQ(check_map(path("map.db")).damage, std::vector<std::string>{});
}

TEST_F(MapSession, AnEarlierLoopCanBeRejectedBeforeTheFirstFrame) {
  drive(0, kPlaces - 1);
  drive(5, 10, {6, 2});
  {
    const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "veto");
    LoopDetector(fast_options(), map).reject({2, 1}, {1, 6});
    map->finish();
  }
  MapReader map(path("map.db"));
  EXPECT_EQ(map.sessions().size(), 2U) << "a session without frames is not stored";
  EXPECT_EQ(map.loops().size(), 5U);
  EXPECT_EQ(map.rejected_loops().at(0).query, (SessionFrame{2, 1}));
  EXPECT_GT(map.rejected_loops().at(0).score, 0);
  const auto reader = std::make_shared<MapReader>(path("map.db"));
  LoopDetector asked(fast_options(), reader);
  for (const auto& change : {std::function<void()>([&] {
                               asked.remove({1, 3});
                             }),
                             std::function<void()>([&] {
                               asked.reject({2, 2}, {1, 7});
                             })}) {
    expect_error(ErrorKind::option, {"map.db", "MapWriter"}, change);
  }
  EXPECT_EQ(asked.query(view(3, {2, 0})).earlier_match, (SessionFrame{1, 3}));
}

}  // namespace
}  // namespace loopbit::test
