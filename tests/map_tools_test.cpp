// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_tools.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "map_support.hpp"
#include "test_support.hpp"
#include "thinning.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

class MapTools : public ScratchTest {};

TEST_F(MapTools, MergingAddsEachSessionOnce) {
  add_session(path("a.db"), 3, "first of a");
  add_session(path("b.db"), 4, "first of b");
  add_session(path("b.db"), 5, "second of b", SessionFrame{1, 2});
  MergeCounts counts = merge_map(path("a.db"), path("b.db"));
  EXPECT_EQ(counts.sessions, 2);
  EXPECT_EQ(counts.places, 9);
  EXPECT_EQ(counts.loops, 1);
  EXPECT_EQ(counts.known, 0);
  counts = merge_map(path("a.db"), path("b.db"));
  EXPECT_EQ(counts.sessions, 0);
  EXPECT_EQ(counts.known, 2);

  MapReader map(path("a.db"));
  EXPECT_EQ(map.sessions().size(), 3U);
  EXPECT_EQ(map.sessions()[2].name, "second of b");
  EXPECT_EQ(places_of(map).size(), 12U);
  expect_only_true_places(map);
  EXPECT_EQ(map.loops().at(0).query, (SessionFrame{3, 4}));
  EXPECT_EQ(map.loops().at(0).match, (SessionFrame{2, 2}));
  EXPECT_TRUE(check_map(path("a.db")).damage.empty());
}

TEST_F(MapTools, ALoopIntoAKnownSessionIsKept) {
  add_session(path("b.db"), 4, "first");
  merge_map(path("a.db"), path("b.db"));
  add_session(path("b.db"), 5, "second", SessionFrame{1, 2});
  const MergeCounts counts = merge_map(path("a.db"), path("b.db"));
  EXPECT_EQ(counts.known, 1);
  EXPECT_EQ(counts.loops, 1);
  EXPECT_EQ(MapReader(path("a.db")).loops().at(0).match, (SessionFrame{1, 2}));
}

TEST_F(MapTools, RejectedLoopsAndLinksAreCopied) {
  add_session(path("b.db"), 4, "first");
  add_session(path("b.db"), 5, "second", SessionFrame{1, 2});
  {
    MapWriter map(path("b.db"), fast_options(), "veto");
    map.reject({2, 4}, {1, 2});
    map.reject({2, 3}, {1, 1});  // never found
  }
  const std::vector<MapLoop> rejected = MapReader(path("b.db")).rejected_loops();
  ASSERT_EQ(rejected.size(), 2U);
  merge_map(path("copy.db"), path("b.db"));
  CompactOptions options;
  options.max_places = 8;
  compact_map(path("b.db"), options);
  recover_map(path("b.db"), path("recovered.db"));
  for (const char* name : {"b.db", "copy.db", "recovered.db"}) {
    MapReader map(path(name));
    EXPECT_EQ(map.rejected_loops(), rejected) << name;
    EXPECT_TRUE(map.loops().empty()) << name;
    EXPECT_TRUE(map.sessions().at(1).linked) << name;
    EXPECT_TRUE(check_map(path(name)).damage.empty()) << name;
  }
  // What met in one map did not meet the sessions of another one.
  add_session(path("a.db"), 3);
  merge_map(path("a.db"), path("b.db"));
  MapReader map(path("a.db"));
  EXPECT_FALSE(map.sessions().at(1).linked);
  EXPECT_FALSE(map.sessions().at(2).linked);
  EXPECT_EQ(map.rejected_loops().at(0).query, (SessionFrame{3, 4}));
}

TEST_F(MapTools, DamagedRejectedLoopsAndLinksAreListed) {
  add_session(path("a.db"), 4);
  add_session(path("a.db"), 4);
  {
    MapWriter map(path("a.db"), fast_options(), "veto");
    map.reject({2, 3}, {1, 1});
  }
  change(path("a.db"), "UPDATE rejected SET match_frame = 2; UPDATE linked SET checksum = 1");
  const MapCheck check = check_map(path("a.db"));
  ASSERT_EQ(check.damage.size(), 3U);
  EXPECT_EQ(check.damage[0], "linked 1: its value differs from its checksum");
  EXPECT_EQ(check.damage[2], "rejected 1: its values differ from their checksum");
}

TEST_F(MapTools, MapsOfOtherSettingsAreNotMerged) {
  add_session(path("a.db"), 3);
  LoopDetectorOptions options = fast_options();
  options.binary_content.gamma = 3;
  {
    MapWriter map(path("b.db"), options, "drive");
    add_frame(map, 0);
  }
  expect_error(ErrorKind::option, {path("a.db"), "binary_content.gamma"},
               [&] { merge_map(path("a.db"), path("b.db")); });
  EXPECT_EQ(places_of(path("a.db")).size(), 3U);
}

TEST_F(MapTools, HalfASessionIsNotMerged) {
  add_session(path("a.db"), 3);
  {
    MapWriter map(path("b.db"), fast_options(), "drive");
    add_frame(map, 0);
    map.flush();
    expect_error(ErrorKind::input, {path("b.db"), "being written"},
                 [&] { merge_map(path("a.db"), path("b.db")); });
    add_frame(map, 1);
  }
  EXPECT_EQ(merge_map(path("a.db"), path("b.db")).places, 2);
}

TEST_F(MapTools, OfADamagedMapNothingIsMerged) {
  add_session(path("a.db"), 3);
  add_session(path("b.db"), 3);
  change(path("b.db"), "UPDATE place SET frame = 9 WHERE place = 2");
  expect_error(ErrorKind::input, {path("b.db"), "place 2"},
               [&] { merge_map(path("a.db"), path("b.db")); });
  EXPECT_EQ(MapReader(path("a.db")).sessions().size(), 1U);
  EXPECT_EQ(places_of(path("a.db")).size(), 3U);
}

TEST_F(MapTools, AMapMergedIntoItselfStaysAsItIs) {
  add_session(path("a.db"), 3, "first");
  add_session(path("a.db"), 3, "second");
  fs::create_symlink("a.db", path("link.db"));
  const MergeCounts counts = merge_map(path("a.db"), path("link.db"));
  EXPECT_EQ(counts.known, 2);
  EXPECT_EQ(counts.sessions + counts.places + counts.loops, 0);
  EXPECT_EQ(places_of(path("a.db")).size(), 6U);
  EXPECT_TRUE(is_one_file(path("a.db")));
}

TEST_F(MapTools, ARefusedMergeLeavesNoLog) {
  add_session(path("a.db"), 3);
  add_session(path("damaged.db"), 3);
  change(path("damaged.db"), "UPDATE place SET frame = 9 WHERE place = 2");
  expect_error(ErrorKind::input, {path("damaged.db")},
               [&] { merge_map(path("a.db"), path("damaged.db")); });
  EXPECT_TRUE(is_one_file(path("a.db")));
  LoopDetectorOptions options = fast_options();
  options.surf.max_keypoints = 200;
  {
    MapWriter map(path("other.db"), options, "drive");
    add_frame(map, 0);
  }
  expect_error(ErrorKind::option, {path("a.db")},
               [&] { merge_map(path("a.db"), path("other.db")); });
  EXPECT_TRUE(is_one_file(path("a.db")));
}

TEST_F(MapTools, WhatIsMergedIsInTheFileAloneAlsoBesideAnIdleReader) {
  add_session(path("b.db"), 40);
  std::unique_ptr<MapReader> reader;
  {
    MapWriter map(path("a.db"), fast_options(), "drive");
    add_frame(map, 0);
    map.flush();
    reader = std::make_unique<MapReader>(path("a.db"));
  }
  merge_map(path("a.db"), path("b.db"));
  fs::copy_file(path("a.db"), path("copy.db"));
  EXPECT_EQ(places_of(path("copy.db")).size(), 41U);
  EXPECT_EQ(places_of(*reader).size(), 41U);
}

TEST_F(MapTools, IntoAMapWithALostSessionNothingIsMerged) {
  add_session(path("a.db"), 3);
  merge_map(path("b.db"), path("a.db"));
  change(path("b.db"), "UPDATE session SET name = 'changed'");
  expect_error(ErrorKind::input, {path("b.db"), "session 1", "--recover"},
               [&] { merge_map(path("b.db"), path("a.db")); });
  EXPECT_EQ(places_of(path("b.db")).size(), 3U);
}

TEST_F(MapTools, DroppingASessionForgetsItAndNoOther) {
  const std::string map_path = path("a.db");
  add_session(map_path, 200, "first");
  add_session(map_path, 5, "second", SessionFrame{1, 2});
  add_session(map_path, 6, "third", SessionFrame{2, 3});
  const CompactCounts counts = compact_map(map_path, {.drop_sessions = {1, 3}});
  EXPECT_EQ(counts.places_before, 211);
  EXPECT_EQ(counts.places_after, 5);
  EXPECT_LT(counts.bytes_after, counts.bytes_before);
  EXPECT_EQ(fs::file_size(map_path), counts.bytes_after);
  MapReader map(map_path);
  ASSERT_EQ(map.sessions().size(), 1U);
  EXPECT_EQ(map.sessions()[0].session, 2);
  EXPECT_TRUE(map.loops().empty());
  expect_only_true_places(map);
  expect_error(ErrorKind::option, {map_path, "session 7"},
               [&] { compact_map(map_path, {.drop_sessions = {7}}); });
}

TEST_F(MapTools, ASessionThatIsNamedTwiceIsDroppedOnce) {
  add_session(path("a.db"), 3, "first");
  add_session(path("a.db"), 4, "second");
  const CompactCounts counts = compact_map(path("a.db"), {.drop_sessions = {1, 2, 1}});
  EXPECT_EQ(counts.places_after, 0);
  EXPECT_TRUE(MapReader(path("a.db")).sessions().empty());
}

TEST_F(MapTools, CompactingKeepsLinkModeAndOwner) {
  constexpr uid_t kSomebody = 1234;
  const bool is_root = geteuid() == 0;
  fs::create_directory(path("real"));
  const std::string real = path("real/a.db");
  add_session(real, 200, "first");
  add_session(real, 5, "second");
  fs::create_symlink("real/a.db", path("link.db"));
  fs::permissions(real, fs::perms::owner_read | fs::perms::owner_write);
  if (is_root) {
    ASSERT_EQ(chown(real.c_str(), kSomebody, kSomebody), 0);
  }
  const CompactCounts counts = compact_map(path("link.db"), {.drop_sessions = {1}});
  EXPECT_TRUE(fs::is_symlink(path("link.db")));
  EXPECT_EQ(fs::file_size(real), counts.bytes_after);
  EXPECT_EQ(places_of(real).size(), 5U);
  EXPECT_EQ(fs::status(real).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  struct stat now {};
  ASSERT_EQ(stat(real.c_str(), &now), 0);
  EXPECT_EQ(now.st_uid, is_root ? kSomebody : geteuid());
}

TEST_F(MapTools, NumbersAreNeverGivenTwice) {
  const std::string map_path = path("a.db");
  add_session(map_path, 3);
  add_session(map_path, 3);
  const auto last = places_of(map_path).back().id;
  compact_map(map_path, {.drop_sessions = {2}});
  add_session(map_path, 3);
  EXPECT_EQ(MapReader(map_path).sessions().back().session, 3);
  EXPECT_EQ(places_of(map_path).back().at, (SessionFrame{3, 2}));
  EXPECT_GT(places_of(map_path)[3].id, last);
}

TEST_F(MapTools, AMapThatIsReadIsNotCompacted) {
  const std::string map_path = path("a.db");
  add_session(map_path, 3);
  MapReader reader(map_path);
  EXPECT_EQ(places_of(reader).size(), 3U);
  {
    MapWriter writer(map_path, fast_options(), "drive");
    add_frame(writer, 0);
    writer.flush();
    EXPECT_EQ(places_of(reader).size(), 4U);  // from the log
  }
  expect_error(ErrorKind::output, {map_path, "being read"},
               [&] { compact_map(map_path, {.drop_sessions = {1}}); });
  EXPECT_EQ(places_of(reader).size(), 4U);
  EXPECT_FALSE(fs::exists(map_path + ".compact"));
}

TEST_F(MapTools, ABudgetKeepsWhatOthersDoNotStandFor) {
  std::vector<ThinnedPlace> places(10, {content_of(0), 1});
  places.push_back({content_of(1), 1});
  places.insert(places.end(), 10, {content_of(2), 1});
  places.push_back({content_of(1), 2, 10});
  const auto kept = kept_places(places, 3);
  EXPECT_EQ(std::count(kept.begin(), kept.end(), true), 3);
  EXPECT_EQ(std::count(kept.begin(), kept.begin() + 10, true), 1);
  EXPECT_EQ(kept[10] + kept[21], 1);
  EXPECT_EQ(std::count(kept.begin() + 11, kept.begin() + 21, true), 1);
  EXPECT_EQ(kept_places(places, 3), kept);
  const auto all = kept_places(places, 100);
  EXPECT_EQ(std::count(all.begin(), all.end(), true), 22);
}

TEST_F(MapTools, ThinningSpreadsOverAPath) {
  // Each place shares half its pixels with the next: no stretch may be emptied.
  std::vector<ThinnedPlace> places;
  places.reserve(64);
  BinaryContent content = content_of(0);
  for (int i = 0; i < 64; ++i) {
    content.rows[static_cast<std::size_t>(i)] = content_of(1).rows[static_cast<std::size_t>(i)];
    places.push_back({content, 1});
  }
  const auto kept = kept_places(places, 8);
  int gap = 0;
  int longest = 0;
  for (const bool keep : kept) {
    gap = keep ? 0 : gap + 1;
    longest = std::max(longest, gap);
  }
  EXPECT_EQ(std::count(kept.begin(), kept.end(), true), 8);
  EXPECT_LE(longest, 20);
}

TEST_F(MapTools, ExportsNumberFramesThroughAllSessions) {
  add_session(path("a.db"), 10, "first");
  add_session(path("a.db"), 5, "second", SessionFrame{1, 7});
  MapReader map(path("a.db"));
  EXPECT_EQ(export_loops(map, ExportFormat::csv),
            "query,match,score,query_session,query_frame,match_session,match_frame,similarity,"
            "matches,inliers\n14,7,0.995,2,4,1,7,0.250000,40,31\n");
  EXPECT_EQ(export_loops(map, ExportFormat::g2o),
            "VERTEX_SE3:QUAT 7 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 14 0 0 0 0 0 0 1\n"
            "EDGE_SE3:QUAT 7 14 0 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n");
  const std::string json = export_loops(map, ExportFormat::json);
  EXPECT_NE(json.find("\"query\": {\n        \"session\": 2,\n        \"frame\": 4"),
            std::string::npos)
      << json;
}

}  // namespace
}  // namespace loopbit::test
