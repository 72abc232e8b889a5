// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Loops between sessions that never met.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/gray_image.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/map_tools.hpp"

#include "map_schema.hpp"
#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kScenes = 16;
constexpr int kReadable = kScenes * 3 / 2 - 2;  ///< frames of a drive

class MapLink : public ScratchTest {
 protected:
  /// One lap and a half through the scenes, some frames of which are unreadable.
  void drive(const std::string& name, cv::Point moved_px, int first = 0) const {
    const auto map = std::make_shared<MapWriter>(path(name), fast_options(), name);
    LoopDetector detector(fast_options(), map);
    for (int frame = first; frame < first + kScenes * 3 / 2; ++frame) {
      if (frame % 11 == 4) {
        detector.skip();
      } else {
        detector.process(view(frame % kScenes, moved_px + cv::Point(frame / kScenes, 0)));
      }
    }
    map->finish();
  }

  /// Two sessions that never met, in merged.db.
  void merge_two() const {
    drive("first.db", {0, 0});
    drive("second.db", {6, 2}, 2);
    merge_map(path("merged.db"), path("first.db"));
    merge_map(path("merged.db"), path("second.db"));
  }

  [[nodiscard]] std::vector<MapLoop> loops_between(const std::string& name) const {
    std::vector<MapLoop> loops = MapReader(path(name)).loops();
    std::erase_if(loops, [](const MapLoop& l) { return l.query.session == l.match.session; });
    return loops;
  }
};

TEST_F(MapLink, FindsTheLoopsThatARunOnTheMapFinds) {
  merge_two();
  EXPECT_EQ(loops_between("merged.db").size(), 0U);
  const std::size_t within = MapReader(path("merged.db")).loops().size();
  const LinkCounts counts = link_map(path("merged.db"));
  EXPECT_EQ(counts.sessions, 1);
  EXPECT_EQ(counts.places, kReadable);
  EXPECT_EQ(counts.total_places, counts.places);

  drive("first.db", {6, 2}, 2);  // on the map of the first one
  const std::vector<MapLoop> expected = loops_between("first.db");
  EXPECT_GT(expected.size(), std::size_t{kScenes});
  EXPECT_EQ(loops_between("merged.db"), expected);
  EXPECT_EQ(counts.loops, std::ssize(expected));
  EXPECT_EQ(MapReader(path("merged.db")).loops().size(), within + expected.size());
  EXPECT_TRUE(MapReader(path("merged.db")).sessions()[1].linked);
  EXPECT_EQ(check_map(path("merged.db")).damage, std::vector<std::string>{});
}

TEST_F(MapLink, ASecondTimeChangesNoByte) {
  merge_two();
  link_map(path("merged.db"));
  EXPECT_TRUE(is_one_file(path("merged.db")));
  const std::string bytes = read_bytes(path("merged.db"));
  const LinkCounts again = link_map(path("merged.db"));
  EXPECT_EQ(again.sessions + again.places + again.total_places + again.loops, 0);
  EXPECT_EQ(read_bytes(path("merged.db")), bytes);
}

TEST_F(MapLink, SessionsOfARunAreLinkedAlready) {
  drive("map.db", {0, 0});
  drive("map.db", {6, 2});
  const MapReader map(path("map.db"));
  EXPECT_TRUE(map.sessions()[0].linked);
  EXPECT_TRUE(map.sessions()[1].linked);
  EXPECT_EQ(link_map(path("map.db")).total_places, 0);
}

TEST_F(MapLink, WhatIsKnownOrRejectedIsNotFoundAgain) {
  merge_two();
  link_map(path("merged.db"));
  const MapLoop wrong = loops_between("merged.db").at(2);
  {
    const auto map = std::make_shared<MapWriter>(path("merged.db"), fast_options(), "veto");
    LoopDetector(fast_options(), map).reject(wrong.query, wrong.match);
  }
  const std::vector<MapLoop> kept = MapReader(path("merged.db")).loops();
  EXPECT_EQ(std::count(kept.begin(), kept.end(), wrong), 0);
  EXPECT_EQ(MapReader(path("merged.db")).rejected_loops(), std::vector<MapLoop>{wrong});
  change(path("merged.db"), "DELETE FROM linked");
  const LinkCounts counts = link_map(path("merged.db"));
  EXPECT_EQ(counts.sessions, 1);
  EXPECT_EQ(counts.loops, 0);
  EXPECT_EQ(MapReader(path("merged.db")).loops(), kept);
}

TEST_F(MapLink, AStopKeepsTheSessionsThatAreDone) {
  merge_two();
  drive("third.db", {3, 1});
  merge_map(path("merged.db"), path("third.db"));
  const auto stops_at = [](std::int64_t frame) {
    return [frame](const LinkCounts& counts) { return counts.places < frame; };
  };
  const std::string bytes = read_bytes(path("merged.db"));
  const LinkCounts none = link_map(path("merged.db"), {}, stops_at(kScenes));
  EXPECT_EQ(none.sessions + none.loops + none.places, 0);
  EXPECT_EQ(none.total_places, 2 * kReadable);
  EXPECT_EQ(read_bytes(path("merged.db")), bytes);

  const LinkCounts one = link_map(path("merged.db"), {}, stops_at(kScenes * 5 / 2));
  EXPECT_EQ(one.sessions, 1);
  EXPECT_EQ(one.loops, std::ssize(loops_between("merged.db")));
  const LinkCounts rest = link_map(path("merged.db"));
  EXPECT_EQ(rest.sessions, 1);
  EXPECT_EQ(rest.total_places, kReadable);
  EXPECT_GT(rest.loops, 0);
  EXPECT_EQ(one.loops + rest.loops, std::ssize(loops_between("merged.db")));
}

TEST_F(MapLink, AnOlderMapGetsWhatIsMissing) {
  drive("map.db", {0, 0});
  drive("map.db", {6, 2});
  make_older(path("map.db"), 2);
  EXPECT_FALSE(MapReader(path("map.db")).sessions()[1].linked);
  EXPECT_TRUE(MapReader(path("map.db")).rejected_loops().empty());
  change(path("map.db"), "DELETE FROM loop WHERE session = 2 AND match_session = 1 AND frame < 5");
  const std::size_t before = loops_between("map.db").size();
  const LinkCounts counts = link_map(path("map.db"));
  EXPECT_EQ(counts.sessions, 1);
  EXPECT_EQ(counts.loops, 4);  // frame 4 is unreadable
  EXPECT_EQ(loops_between("map.db").size(), before + 4);
  EXPECT_TRUE(MapReader(path("map.db")).sessions()[1].linked);
}

TEST_F(MapLink, SettingsMayDifferButForThoseOfPlaces) {
  merge_two();
  LoopDetectorOptions options = fast_options();
  options.surf.max_keypoints = 200;
  expect_error(ErrorKind::option, {"merged.db", "surf.max_keypoints"},
               [&] { link_map(path("merged.db"), options); });
  options = fast_options();
  options.decision.min_score = 1;
  EXPECT_EQ(link_map(path("merged.db"), options).loops, 0);
}

TEST_F(MapLink, ADamagedMapStaysAsItIs) {
  merge_two();
  change(path("merged.db"), "UPDATE features SET checksum = 0 WHERE place = 3");
  const std::string bytes = read_bytes(path("merged.db"));
  expect_error(ErrorKind::input, {"merged.db", "place 3"}, [&] { link_map(path("merged.db")); });
  EXPECT_EQ(read_bytes(path("merged.db")), bytes);
}

TEST_F(MapLink, NeedsAMapThatNobodyWrites) {
  expect_error(ErrorKind::input, {"no map", "none.db"}, [&] { link_map(path("none.db")); });
  const MapWriter map(path("map.db"), fast_options(), "drive");
  expect_error(ErrorKind::output, {"map.db", "being written"}, [&] { link_map(path("map.db")); });
}

class RealMapLink : public MapLink {
 protected:
  using Change = std::function<void(cv::Mat& image)>;

  /// A session with some images of a real sequence.
  void walk(const std::string& name, const std::string& images, int first, int last,
            const Change& change = {}) const {
    const auto source = open_source((*data_dir() / images).string());
    const auto map = std::make_shared<MapWriter>(path(name), LoopDetectorOptions{}, name);
    LoopDetector detector(LoopDetectorOptions{}, map);
    Frame frame;
    for (int i = 0; i <= last && source->next(frame); ++i) {
      if (i < first) continue;
      if (change) change(frame.image);
      detector.process(frame.image);
    }
    map->finish();
  }

  void merge_both() const {
    merge_map(path("merged.db"), path("first.db"));
    merge_map(path("merged.db"), path("second.db"));
  }
};

TEST_F(RealMapLink, TwoWalksThroughACorridor) {
  LOOPBIT_NEEDS_DATA("corridor_loop");
  walk("first.db", "corridor_loop/images", 0, 41);
  walk("second.db", "corridor_loop/images", 42, 83);
  merge_both();
  EXPECT_EQ(link_map(path("merged.db")).places, 42);
  walk("first.db", "corridor_loop/images", 42, 83);
  const std::vector<MapLoop> expected = loops_between("first.db");
  EXPECT_GT(expected.size(), 35U);
  EXPECT_EQ(loops_between("merged.db"), expected);
}

// The first views of a session still show the robot, which is in those of the other one, too.
TEST_F(RealMapLink, ARobotInViewIsNoPlace) {
  LOOPBIT_NEEDS_DATA("gardens_point");
  LOOPBIT_NEEDS_DATA("graf");
  const cv::Mat robot = cv::imread((*data_dir() / "graf/img1.png").string(), cv::IMREAD_GRAYSCALE);
  const auto attach = [&](cv::Mat& image) {
    image = gray_image(image).clone();
    const int height = image.rows / 4;
    cv::Mat lowest = image.rowRange(image.rows - height, image.rows);
    cv::resize(robot, lowest, lowest.size(), 0, 0, cv::INTER_AREA);
  };
  walk("first.db", "gardens_point/day_left", 0, 29, attach);
  walk("second.db", "gardens_point/day_right", 100, 129, attach);
  merge_both();
  EXPECT_EQ(link_map(path("merged.db")).places, 30);
  EXPECT_EQ(loops_between("merged.db").size(), 0U) << "of different parts of the campus";
}

}  // namespace
}  // namespace loopbit::test
