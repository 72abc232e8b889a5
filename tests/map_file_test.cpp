// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_file.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

#include "loopbit/loop_detector.hpp"
#include "loopbit/map_tools.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

class MapFile : public ScratchTest {
 protected:
  std::string map_path_;
  void SetUp() override {
    ScratchTest::SetUp();
    map_path_ = path("map.db");
  }
};

TEST_F(MapFile, GivesBackWhatWasAdded) {
  add_session(map_path_, 40);
  MapReader map(map_path_);
  const auto places = places_of(map);
  ASSERT_EQ(places.size(), 40U);
  EXPECT_EQ(places[7].at, (SessionFrame{1, 7}));
  expect_only_true_places(map);
  for (const MapPlace& place : places) EXPECT_TRUE(map.features_of(place).has_value());
  ASSERT_EQ(map.sessions().size(), 1U);
  EXPECT_EQ(map.sessions()[0].name, "drive");
  EXPECT_EQ(map.sessions()[0].frames, 40);
  EXPECT_EQ(map.sessions()[0].uid.size(), 32U);
  LoopDetectorOptions of_shape;  // a map fixes what its places are made of, not the decision
  of_shape.surf = fast_options().surf;
  EXPECT_EQ(to_json(map.options()), to_json(of_shape));
  EXPECT_TRUE(map.damage().empty());
  EXPECT_TRUE(map.check_structure().empty());
}

TEST_F(MapFile, AFinishedSessionTakesNothingMore) {
  MapWriter map(map_path_, fast_options(), "drive");
  add_frame(map, 0);
  map.finish();
  map.finish();
  expect_error(ErrorKind::option, {"finished"}, [&] { add_frame(map, 1); });
  expect_error(ErrorKind::option, {"finished"}, [&] { (void)map.features(0); });
  EXPECT_EQ(places_of(map_path_).size(), 1U);
}

TEST_F(MapFile, AFinishedSessionLetsOthersWrite) {
  MapWriter first(map_path_, fast_options(), "first");
  add_frame(first, 0);
  first.finish();
  MapWriter second(map_path_, fast_options(), "second");
  EXPECT_EQ(second.session(), 2);
  first.finish();
  expect_error(ErrorKind::output, {"being written"},
               [&] { const MapWriter third(map_path_, fast_options(), "third"); });
}

TEST_F(MapFile, LateLoopsAreLoopsAndWithdrawnOnesAreRejected) {
  {
    MapWriter map(map_path_, fast_options(), "drive");
    for (int frame = 0; frame < 4; ++frame) add_frame(map, frame);
    add_frame(map, 4, SessionFrame{1, 0});
    Detection later{.frame = 5, .status = Status::low_score};
    later.late_loops = {{.frame = 3, .match = 1, .score = 0.99, .similarity = 0.5}};
    later.withdrawn_loops = {{.frame = 4, .earlier_match = SessionFrame{1, 0}, .score = 0.25}};
    map.add(later, content_of(5), std::make_shared<const Features>(few_features(5)), {});
    map.finish();
  }
  MapReader map(map_path_);
  ASSERT_EQ(map.loops().size(), 1U);
  EXPECT_EQ(map.loops()[0].query, (SessionFrame{1, 3}));
  EXPECT_EQ(map.loops()[0].match, (SessionFrame{1, 1}));
  EXPECT_EQ(map.loops()[0].score, 0.99);
  EXPECT_EQ(map.loops()[0].similarity, 0.5);
  EXPECT_EQ(map.loops()[0].inliers, 0);
  ASSERT_EQ(map.rejected_loops().size(), 1U);
  EXPECT_EQ(map.rejected_loops()[0].query, (SessionFrame{1, 4}));
  EXPECT_EQ(map.rejected_loops()[0].match, (SessionFrame{1, 0}));
  EXPECT_TRUE(map.damage().empty());
}

TEST_F(MapFile, KeepsSessionsAndLoopsApart) {
  add_session(map_path_, 5, "first");
  add_session(map_path_, 6, "second", SessionFrame{1, 4});
  MapReader map(map_path_);
  EXPECT_EQ(places_of(map).back().at, (SessionFrame{2, 5}));
  const MapLoop loop{{2, 5}, {1, 4}, 0.995, 0.25, 40, 31};
  EXPECT_EQ(map.loops(), std::vector<MapLoop>{loop});
  EXPECT_NE(map.sessions()[0].uid, map.sessions()[1].uid);
}

TEST_F(MapFile, ASessionWithoutFramesLeavesNoTrace) {
  { const MapWriter map(map_path_, fast_options(), "nothing"); }
  EXPECT_TRUE(MapReader(map_path_).sessions().empty());
  add_session(map_path_, 1);
  EXPECT_EQ(MapReader(map_path_).sessions()[0].session, 1);
}

TEST_F(MapFile, UnreadableFramesAreNoPlaces) {
  {
    MapWriter map(map_path_, fast_options(), "drive");
    add_frame(map, 0);
    map.add({.frame = 1, .status = Status::unreadable}, {}, std::make_shared<const Features>(),
            cv::Mat());
    add_frame(map, 2);
  }
  MapReader map(map_path_);
  const auto places = places_of(map);
  ASSERT_EQ(places.size(), 2U);
  EXPECT_EQ(places[1].at, (SessionFrame{1, 2}));
  EXPECT_EQ(map.sessions()[0].frames, 3);
}

TEST_F(MapFile, SavedFramesAreSeenByReadersBesideTheWriter) {
  MapWriter map(map_path_, fast_options(), "drive");
  for (int frame = 0; frame < 10; ++frame) add_frame(map, frame);
  map.flush();
  EXPECT_EQ(map.saved_frames(), 10);
  MapReader reader(map_path_);
  EXPECT_EQ(places_of(reader).size(), 10U);
  for (int frame = 10; frame < 100; ++frame) add_frame(map, frame);
  map.flush();
  EXPECT_EQ(places_of(reader).size(), 100U);
  expect_only_true_places(reader);
  map.finish();
  EXPECT_EQ(places_of(reader).size(), 100U);
}

TEST_F(MapFile, AFinishedSessionIsInTheFileAloneAlsoBesideAnIdleReader) {
  MapWriter map(map_path_, fast_options(), "drive");
  for (int frame = 0; frame < 5; ++frame) add_frame(map, frame);
  map.flush();
  MapReader reader(map_path_);
  for (int frame = 5; frame < 60; ++frame) add_frame(map, frame);
  map.finish();
  fs::copy_file(map_path_, path("copy.db"));
  EXPECT_EQ(places_of(path("copy.db")).size(), 60U);
  EXPECT_EQ(places_of(reader).size(), 60U);
}

TEST_F(MapFile, ZeroIsZeroWhateverItsSign) {
  {
    MapWriter map(map_path_, fast_options(), "drive");
    map.add({.frame = 0,
             .timestamp_s = -0.0,
             .status = Status::loop,
             .earlier_match = SessionFrame{1, 0},
             .score = -0.0,
             .similarity = -0.0},
            content_of(0), std::make_shared<const Features>(few_features(0)), cv::Mat());
  }
  MapReader map(map_path_);
  ASSERT_EQ(places_of(map).size(), 1U);
  EXPECT_EQ(places_of(map)[0].timestamp_s, 0.0);
  EXPECT_EQ(map.loops().size(), 1U);
  EXPECT_EQ(map.damage(), std::vector<std::string>{});
  EXPECT_EQ(recover_map(map_path_, path("new.db")).places, 1);
}

TEST_F(MapFile, DescriptorsThatNoKernelTakesAreLost) {
  Features features = few_features(0);
  features.descriptors[1][5] = -128;
  MapWriter writer(map_path_, fast_options(), "drive");
  writer.add({.frame = 0}, content_of(0), std::make_shared<const Features>(features), cv::Mat());
  writer.finish();
  MapReader map(map_path_);
  EXPECT_FALSE(map.features_of(places_of(map).front()));
  EXPECT_FALSE(map.damage().empty());
}

TEST_F(MapFile, AWriterGivesTheFeaturesOfPlacesSavedAndPending) {
  add_session(map_path_, 3);
  MapWriter map(map_path_, fast_options(), "drive");
  int earlier = 0;
  map.for_each_earlier_place([&](const SessionFrame&, const BinaryContent&) { ++earlier; });
  EXPECT_EQ(earlier, 3);
  add_frame(map, 0);
  EXPECT_TRUE(same_features(*map.features(3), few_features(0)));
  map.flush();
  EXPECT_TRUE(same_features(*map.features(3), few_features(0)));
  EXPECT_TRUE(same_features(*map.features(2), few_features(2)));
}

TEST_F(MapFile, ASecondWriterIsRefusedUntilTheFirstEnds) {
  {
    MapWriter first(map_path_, fast_options(), "first");
    add_frame(first, 0);
    expect_error(ErrorKind::output, {map_path_, "being written"},
                 [&] { const MapWriter second(map_path_, fast_options(), "second"); });
    expect_error(ErrorKind::output, {"being written"}, [&] { compact_map(map_path_, {{1}, 0}); });
  }
  const MapWriter second(map_path_, fast_options(), "second");
  EXPECT_EQ(second.session(), 2);
}

TEST_F(MapFile, ALinkIsTheMapThatItNames) {
  fs::create_directory(path("real"));
  fs::create_symlink("real/map.db", path("link.db"));
  fs::create_symlink("link.db", path("again.db"));
  const std::string names[] = {path("real/map.db"), path("link.db"), path("again.db"),
                               path("real/../real/map.db")};
  for (const std::string& first : names) {  // the first one makes the map
    MapWriter map(first, fast_options(), "first");
    add_frame(map, 0);
    for (const std::string& second : names) {
      expect_error(ErrorKind::output, {second, "being written"},
                   [&] { const MapWriter refused(second, fast_options(), "second"); });
    }
    map.finish();
    fs::remove(path("real/map.db"));
  }
}

TEST_F(MapFile, AMapMadeWithOtherSettingsIsRefused) {
  add_session(map_path_, 1);
  LoopDetectorOptions options = fast_options();
  options.decision.min_score = 0.9;  // shapes no place
  { const MapWriter map(map_path_, options, "drive"); }
  options.surf.max_keypoints = 200;
  expect_error(ErrorKind::option,
               {map_path_, "surf.max_keypoints = 300", "has 200", "--set surf.max_keypoints=300"},
               [&] { const MapWriter map(map_path_, options, "drive"); });
}

TEST_F(MapFile, ARefusedSessionLeavesTheMapAsItIs) {
  add_session(map_path_, 3);
  const std::string before = read_bytes(map_path_);
  LoopDetectorOptions options = fast_options();
  options.surf.max_keypoints = 200;
  expect_error(ErrorKind::option, {map_path_},
               [&] { const MapWriter map(map_path_, options, "drive"); });
  EXPECT_EQ(read_bytes(map_path_), before);
  EXPECT_TRUE(is_one_file(map_path_));
}

TEST_F(MapFile, OtherFilesAreRefused) {
  add_session(map_path_, 1);
  expect_error(ErrorKind::input, {path("none.db"), "loopbit run"},
               [&] { const MapReader map(path("none.db")); });
  const std::string text = write("text.db", std::string(100'000, 'x'));
  expect_error(ErrorKind::input, {text, "no map"}, [&] { const MapReader map(text); });
  expect_error(ErrorKind::input, {text}, [&] { const MapWriter map(text, fast_options(), ""); });
  const std::string empty = write("empty.db", "");
  expect_error(ErrorKind::input, {empty, "empty"}, [&] { const MapReader map(empty); });
  change(path("other.db"), "CREATE TABLE place (place INTEGER PRIMARY KEY)");
  expect_error(ErrorKind::input, {"no map of loopbit's"},
               [&] { const MapReader map(path("other.db")); });
}

TEST_F(MapFile, PathsThatLeadNowhereAreNamed) {
  fs::create_symlink("loop.db", path("loop.db"));
  const std::string long_name = path(std::string(300, 'x'));
  for (const std::string& name : {path("loop.db"), long_name}) {
    expect_error(ErrorKind::input, {name, "cannot be read", "path"},
                 [&] { const MapReader map(name); });
    expect_error(ErrorKind::output, {name},
                 [&] { const MapWriter map(name, fast_options(), "drive"); });
    expect_error(ErrorKind::input, {name}, [&] { recover_map(name, path("new.db")); });
  }
}

/// Not the superuser, who may read everything, as long as this lives.
class OrdinaryUser {
 public:
  OrdinaryUser() { become(getuid() == 0 ? 65534 : getuid()); }
  ~OrdinaryUser() { become(getuid()); }
  OrdinaryUser(const OrdinaryUser&) = delete;
  OrdinaryUser& operator=(const OrdinaryUser&) = delete;
  OrdinaryUser(OrdinaryUser&&) = delete;
  OrdinaryUser& operator=(OrdinaryUser&&) = delete;

 private:
  static void become(uid_t user) { EXPECT_EQ(seteuid(user), 0); }
};

TEST_F(MapFile, AMapThatMayNotBeReadIsNotCalledDamaged) {
  add_session(map_path_, 1);
  fs::permissions(fs::path(map_path_).parent_path(), fs::perms::all);
  fs::permissions(map_path_, fs::perms::none);
  const OrdinaryUser user;
  const auto words = {std::string_view(map_path_), std::string_view("Permission denied"),
                      std::string_view("the permissions of the file")};
  expect_error(ErrorKind::input, words, [&] { const MapReader map(map_path_); });
  expect_error(ErrorKind::input, words, [&] { recover_map(map_path_, path("new.db")); });
  expect_error(ErrorKind::output, words,
               [&] { const MapWriter map(map_path_, fast_options(), "drive"); });
}

TEST_F(MapFile, ANewMapInAFolderThatMayNotBeWrittenSaysSo) {
  const std::string folder = path("theirs");
  fs::create_directory(folder);
  fs::permissions(fs::path(folder).parent_path(), fs::perms::all);
  const OrdinaryUser user;
  expect_error(ErrorKind::output, {"theirs/new.db", "Permission denied"},
               [&] { const MapWriter map(folder + "/new.db", fast_options(), "drive"); });
}

TEST_F(MapFile, ANewerVersionIsRefused) {
  add_session(map_path_, 1);
  change(map_path_, "PRAGMA user_version = 5");
  const auto words = {std::string_view("version 5"), std::string_view("newer loopbit")};
  expect_error(ErrorKind::input, words, [&] { const MapReader map(map_path_); });
  expect_error(ErrorKind::input, words,
               [&] { const MapWriter map(map_path_, fast_options(), "drive"); });
  expect_error(ErrorKind::input, words, [&] { recover_map(map_path_, path("new.db")); });
  EXPECT_FALSE(fs::exists(path("new.db")));
}

TEST_F(MapFile, StrangeTablesAreRefused) {
  for (const char* sql :
       {"CREATE TABLE stranger (x)", "CREATE VIEW stranger AS SELECT * FROM place",
        "CREATE TRIGGER stranger AFTER INSERT ON place BEGIN DELETE FROM place; END"}) {
    const std::string copy = path("copy.db");
    fs::remove(copy);
    add_session(copy, 1);
    change(copy, sql);
    expect_error(ErrorKind::input, {copy, "'stranger'"}, [&] { const MapReader map(copy); });
  }
  add_session(map_path_, 1);
  change(map_path_, "DROP TABLE loop");
  expect_error(ErrorKind::input, {"lacks"}, [&] { const MapReader map(map_path_); });
}

/// Any value changed by hand: its row is left out, all others are there.
TEST_F(MapFile, ChangedRowsAreLeftOut) {
  add_session(map_path_, 3, "first");
  add_session(map_path_, 3, "second", SessionFrame{1, 1});
  const auto expect_damage = [&](const std::string& sql, std::size_t places, std::size_t sessions,
                                 std::size_t loops) {
    const std::string copy = path("copy.db");
    fs::copy_file(map_path_, copy, fs::copy_options::overwrite_existing);
    change(copy, sql);
    MapReader map(copy);
    EXPECT_EQ(places_of(map).size(), places) << sql;
    EXPECT_EQ(map.sessions().size(), sessions) << sql;
    EXPECT_EQ(map.loops().size(), loops) << sql;
    expect_only_true_places(map);
    EXPECT_EQ(map.damage().size(), 1U) << sql;
    EXPECT_EQ(check_map(copy).damage.empty(), false) << sql;
  };
  expect_damage("UPDATE place SET frame = 2 WHERE place = 2", 5, 2, 1);
  expect_damage("UPDATE place SET session = 2 WHERE place = 2", 5, 2, 1);
  expect_damage("UPDATE place SET timestamp = NULL WHERE place = 2", 5, 2, 1);
  expect_damage("UPDATE place SET content = zeroblob(512) WHERE place = 2", 5, 2, 1);
  expect_damage("UPDATE place SET content = 'short' WHERE place = 2", 5, 2, 1);
  expect_damage("UPDATE features SET features = zeroblob(16) WHERE place = 2", 6, 2, 1);
  expect_damage("DELETE FROM features WHERE place = 2", 6, 2, 1);
  expect_damage("UPDATE session SET name = 'changed' WHERE session = 1", 6, 1, 1);
  expect_damage("UPDATE session SET frames = -1 WHERE session = 1", 6, 1, 1);
  expect_damage("UPDATE loop SET match_frame = 2", 6, 2, 0);
}

TEST_F(MapFile, ADamagedMapIsNotWrittenToButRecovered) {
  add_session(map_path_, 3, "first");
  add_session(map_path_, 3, "second", SessionFrame{1, 1});
  change(map_path_,
         "UPDATE place SET frame = 7 WHERE place = 2; DELETE FROM session WHERE session "
         "= 2");
  MapWriter map(map_path_, fast_options(), "third");
  expect_error(ErrorKind::input, {map_path_, "place 2", "--recover"}, [&] {
    const LoopDetector detector(fast_options(), {&map, [](auto*) {}});
  });
  const MapCheck check = recover_map(map_path_, path("new.db"));
  EXPECT_EQ(check.places, 5);
  EXPECT_EQ(check.sessions, 2);
  EXPECT_EQ(check.loops, 1);
  MapReader recovered(path("new.db"));
  EXPECT_TRUE(check_map(path("new.db")).damage.empty());
  EXPECT_EQ(recovered.sessions()[1].name, "recovered");
  EXPECT_EQ(recovered.sessions()[1].frames, 3);
  expect_only_true_places(recovered);
  expect_error(ErrorKind::output, {path("new.db"), "exists"},
               [&] { recover_map(map_path_, path("new.db")); });
}

TEST_F(MapFile, WithoutAServerAnAddressIsRefusedAndItsPasswordNotTold) {
  const std::string address = "postgresql://robot:secret@host/town";
  const std::vector<std::function<void()>> uses{
      [&] { MapReader map(address); },
      [&] { MapWriter(address, fast_options(), "drive"); },
      [&] { merge_map(map_path_, address); },
      [&] { merge_map(address, map_path_); },
      [&] { compact_map(address, {.drop_sessions = {1}}); },
      [&] { recover_map(address, path("new.db")); },
      [&] { recover_map(map_path_, address); },
  };
  add_session(map_path_, 1);
  for (const auto& use : uses) {
    try {
      use();
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::option);
      EXPECT_NE(std::string(error.what()).find("postgresql://..."), std::string::npos);
      EXPECT_EQ(std::string(error.what()).find("secret"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace loopbit::test
