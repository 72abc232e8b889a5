// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A map's log belongs to one file, and a file has one writer, whatever their names.
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "loopbit/database.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/map_tools.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPageBytes = 16384;

/// Does `work` in a process of its own, which ends with _exit(0): as if it were killed.
void killed_after(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
}

/// Adds a session of so many frames, and is killed when they are saved.
void add_killed_session(const std::string& path, int frames) {
  killed_after([&] {
    MapWriter map(path, fast_options(), "killed");
    for (int frame = 0; frame < frames; ++frame) add_frame(map, frame);
    map.flush();
    _exit(0);
  });
  ASSERT_GT(fs::file_size(path + "-wal"), 0U);
}

class MapLog : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    a_ = path("a.db");
    b_ = path("b.db");
  }

  /// All that opens `map` is refused, and changes nothing.
  void expect_refused(const std::string& map, const std::string& words) {
    const std::string before = read_bytes(map);
    const std::string log = read_bytes(map + "-wal") + read_bytes(map + "-journal");
    expect_error(ErrorKind::input, {map, words}, [&] { const MapReader reader(map); });
    expect_error(ErrorKind::input, {map, words}, [&] { check_map(map); });
    expect_error(ErrorKind::input, {map, words}, [&] { recover_map(map, path("new.db")); });
    expect_error(ErrorKind::input, {map, words}, [&] { compact_map(map, {{1}, 0}); });
    expect_error(ErrorKind::input, {map, words}, [&] { merge_map(path("into.db"), map); });
    EXPECT_ANY_THROW(MapWriter(map, fast_options(), "drive"));
    EXPECT_EQ(read_bytes(map), before);
    EXPECT_EQ(read_bytes(map + "-wal") + read_bytes(map + "-journal"), log);
  }

  std::string a_;
  std::string b_;
};

TEST_F(MapLog, AMapWithTwoNamesIsReadButNotWritten) {
  add_session(a_, 3);
  fs::create_hard_link(a_, b_);
  const std::string before = read_bytes(a_);
  for (const std::string& name : {a_, b_}) {
    EXPECT_EQ(places_of(name).size(), 3U);
    expect_error(ErrorKind::output, {name, "has 2 names", "Copy the map"},
                 [&] { const MapWriter map(name, fast_options(), "drive"); });
  }
  EXPECT_EQ(read_bytes(a_), before);
  fs::remove(a_);
  add_session(b_, 2);
  EXPECT_EQ(places_of(b_).size(), 5U);
}

TEST_F(MapLog, AFileHasOneWriterUnderAllNames) {
  MapWriter first(a_, fast_options(), "first");
  add_frame(first, 0);
  first.flush();
  fs::rename(a_, b_);
  fs::rename(a_ + "-wal", b_ + "-wal");
  expect_error(ErrorKind::output, {b_, "being written"},
               [&] { const MapWriter second(b_, fast_options(), "second"); });
}

TEST_F(MapLog, ALogBesideAnotherNameIsNotMissed) {
  add_killed_session(a_, 3);
  fs::create_hard_link(a_, b_);
  expect_refused(b_, "another name of the file");
  fs::remove(b_);
  EXPECT_EQ(places_of(a_).size(), 3U);
}

TEST_F(MapLog, OfAnotherMapIsRefusedBesideAClosedOne) {
  add_session(a_, 3);
  add_killed_session(b_, 5);
  fs::copy_file(b_ + "-wal", a_ + "-wal");
  expect_refused(a_, a_ + "-wal' is the log of another map");
  fs::remove(a_ + "-wal");
  EXPECT_EQ(places_of(a_).size(), 3U);
}

TEST_F(MapLog, OfAnotherMapIsRefusedBesideAKilledOne) {
  add_killed_session(a_, 3);
  add_killed_session(b_, 5);
  fs::copy_file(b_ + "-wal", a_ + "-wal", fs::copy_options::overwrite_existing);
  expect_refused(a_, a_ + "-wal' is the log of another map");
}

TEST_F(MapLog, OfAnotherCopyIsRefused) {
  add_session(a_, 3);
  fs::copy_file(a_, b_);
  add_killed_session(a_, 3);
  add_killed_session(b_, 5);
  fs::copy_file(b_ + "-wal", a_ + "-wal", fs::copy_options::overwrite_existing);
  expect_refused(a_, "of another copy of");
}

TEST_F(MapLog, GoesWithItsFile) {
  add_killed_session(a_, 3);
  fs::create_directory(path("elsewhere"));
  const std::string moved = path("elsewhere/c.db");
  fs::rename(a_, moved);
  fs::rename(a_ + "-wal", moved + "-wal");
  EXPECT_EQ(places_of(moved).size(), 3U);
  add_session(moved, 2);
  EXPECT_EQ(places_of(moved).size(), 5U);
  EXPECT_TRUE(is_one_file(moved));
}

TEST_F(MapLog, CutAnywhereIsStillTheMapsOwn) {
  add_session(a_, 3);
  killed_after([&] {
    MapWriter map(a_, fast_options(), "killed");
    for (int frame = 0; frame < 3; ++frame) {
      add_frame(map, frame);
      map.flush();
    }
    _exit(0);
  });
  const std::string log = read_bytes(a_ + "-wal");
  std::size_t before = 3;
  for (std::size_t size = 0; size <= log.size(); size += 2999) {
    const std::string cut = write("cut.db", read_bytes(a_));
    (void)write("cut.db-wal", log.substr(0, size));
    const std::size_t places = places_of(cut).size();
    EXPECT_GE(places, before) << size;
    before = places;
    if (size % 5 == 0) add_session(cut, 1);
    remove_database(cut);
  }
  EXPECT_GT(before, 3U);
  EXPECT_EQ(places_of(a_).size(), 6U);
}

TEST_F(MapLog, OfAnOlderLoopbitIsTakenIn) {
  add_session(a_, 3);
  killed_after([&] {
    const Database old(a_, Database::Access::create, {});
    old.set_schema_version(6);  // as SQLite counts
    old.execute("PRAGMA journal_mode = WAL");
    old.execute("DELETE FROM place WHERE place = 3; DELETE FROM features WHERE place = 3");
    _exit(0);
  });
  EXPECT_EQ(places_of(a_).size(), 2U);
  add_session(a_, 2);
  EXPECT_EQ(places_of(a_).size(), 4U);
}

TEST_F(MapLog, EachRunsLogIsToldFromTheLast) {
  add_killed_session(a_, 3);
  const std::string log = read_bytes(a_ + "-wal");
  add_killed_session(a_, 3);
  (void)write("a.db-wal", log);
  expect_refused(a_, "is the log of another map");
}

TEST_F(MapLog, ARefusedRunChangesNoByte) {
  add_session(a_, 3);
  change(a_, "UPDATE place SET frame = 9 WHERE place = 2");
  const std::string before = read_bytes(a_);
  expect_error(ErrorKind::input, {a_, "left as it is"}, [&] {
    const auto map = std::make_shared<MapWriter>(a_, fast_options(), "drive");
    const LoopDetector detector(fast_options(), map);
  });
  EXPECT_EQ(read_bytes(a_), before);
  EXPECT_TRUE(is_one_file(a_));
}

TEST_F(MapLog, ARunRefusedAtItsFirstCommitChangesNoByte) {
  for (const std::string& map : {a_, b_}) {
    add_session(map, 6);
    if (map == b_) make_older(map, 1);
    // Features are not read before places are compared, but written with the first frame.
    const auto page = Database(map, Database::Access::create, {})
                          .integer("SELECT rootpage FROM sqlite_schema WHERE name = 'features'");
    std::string bytes = read_bytes(map);
    bytes[static_cast<std::size_t>(page - 1) * kPageBytes] = '\xff';
    (void)write(fs::path(map).filename().string(), bytes);
    expect_error(ErrorKind::input, {map, "malformed"}, [&] { add_session(map, 3); });
    EXPECT_EQ(read_bytes(map), bytes);
    EXPECT_TRUE(is_one_file(map));
    EXPECT_FALSE(fs::exists(map + "-journal"));
  }
}

/// What SQLite leaves where it is killed in the midst of a commit without a log.
void leave_journal(const std::string& path) {
  killed_after([&] {
    const Database database(path, Database::Access::create, {});
    database.execute(
        "PRAGMA cache_size = 1; BEGIN IMMEDIATE; PRAGMA user_version = 2; UPDATE place SET session "
        "= 7, content = zeroblob(40000); UPDATE features SET features = zeroblob(40000)");
    _exit(0);
  });
  ASSERT_GT(fs::file_size(path + "-journal"), kPageBytes);
}

TEST_F(MapLog, AJournalOfItsOwnIsUndone) {
  add_session(a_, 3);
  leave_journal(a_);
  EXPECT_EQ(check_map(a_).places, 3);
  EXPECT_TRUE(check_map(a_).damage.empty());
}

TEST_F(MapLog, AJournalOfItsOwnIsUndoneAfterAllPagesWereWritten) {
  add_session(a_, 3);
  const std::string before = read_bytes(a_);
  std::string journal;
  {
    const Database database(a_, Database::Access::create, {});
    const auto mark = database.integer("PRAGMA schema_version");
    database.execute(
        "PRAGMA journal_mode = PERSIST; BEGIN IMMEDIATE; PRAGMA user_version = 2; UPDATE place SET "
        "session = 7");
    database.set_schema_version(static_cast<std::int32_t>(5 << 16 | mark >> 16));
    journal = read_bytes(a_ + "-journal").substr(0, 28);  // a commit erases these bytes
    database.execute("COMMIT");
    journal += read_bytes(a_ + "-journal").substr(28);
  }
  // As SQLite begins one that holds as many pages as it is long.
  journal.replace(0, 12, "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7\xff\xff\xff\xff");
  ASSERT_FALSE(read_bytes(a_) == before);
  (void)write("a.db-journal", journal);
  EXPECT_EQ(check_map(a_).places, 3);
  EXPECT_TRUE(read_bytes(a_) == before);
}

TEST_F(MapLog, AJournalOfAnotherMapIsRefused) {
  add_session(a_, 3);
  add_session(b_, 5);
  fs::copy_file(b_, path("c.db"));
  leave_journal(b_);
  for (const std::string& map : {a_, path("made.db")}) {
    (void)write("made.db", "");
    fs::copy_file(b_ + "-journal", map + "-journal");
    expect_refused(map, map + "-journal' is the journal of another map");
  }
  // Of another copy, which has gone on since.
  add_session(path("c.db"), 1);
  fs::copy_file(b_ + "-journal", path("c.db-journal"));
  expect_refused(path("c.db"), "of another copy of");
}

TEST_F(MapLog, ARunWithoutFramesChangesNoByte) {
  add_session(a_, 3);
  const std::string before = read_bytes(a_);
  add_session(a_, 0);
  EXPECT_EQ(read_bytes(a_), before);
}

TEST_F(MapLog, AHeaderThatForbidsWritingIsDamage) {
  add_session(b_, 3);
  for (const std::size_t at : {18U, 19U}) {  // sqlite.org/fileformat2.html, 1.3.3
    std::string bytes = read_bytes(b_);
    bytes[at] = at == 18 ? '\3' : '\2';
    const std::string damaged = write("damaged.db", bytes);
    const MapCheck check = check_map(damaged);
    ASSERT_EQ(check.damage.size(), 1U);
    EXPECT_NE(check.damage.front().find("its header gives"), std::string::npos);
    EXPECT_EQ(check.places, 3);
    const auto words = {std::string_view(damaged), std::string_view("is damaged"),
                        std::string_view("--recover")};
    expect_error(ErrorKind::input, words, [&] { MapWriter(damaged, fast_options(), "drive"); });
    expect_error(ErrorKind::input, words, [&] { merge_map(damaged, b_); });
    expect_error(ErrorKind::input, words, [&] { compact_map(damaged, {{1}, 0}); });
    expect_error(ErrorKind::input, words, [&] { merge_map(path("into.db"), damaged); });
    EXPECT_EQ(read_bytes(damaged), bytes);
    const std::string mended = path("mended" + std::to_string(at) + ".db");
    EXPECT_EQ(recover_map(damaged, mended).places, 3);
    EXPECT_TRUE(check_map(mended).damage.empty());
    add_session(mended, 2);
    remove_database(damaged);
  }
}

/// As when a run ends while its live page reads a picture.
TEST_F(MapLog, IsClosedAsSoonAsTheLastReaderIsGone) {
  const std::string file = path("evidence.db");
  const Database writer(file, Database::Access::create, {});
  writer.execute("PRAGMA journal_mode = WAL; CREATE TABLE frame (frame INTEGER PRIMARY KEY)");
  auto reader = std::make_unique<Database>(file, Database::Access::read, Database::Remedies{});
  EXPECT_EQ(reader->integer("SELECT count(*) FROM frame"), 0);
  constexpr const char* kClose = "PRAGMA journal_mode = DELETE";
  expect_error(ErrorKind::output, {file, "another program holds it"},
               [&] { writer.execute(kClose); });
  std::thread leaves([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    reader.reset();
  });
  EXPECT_NO_THROW(writer.execute_alone(kClose));
  leaves.join();
  EXPECT_FALSE(fs::exists(file + "-wal"));
}

}  // namespace
}  // namespace loopbit::test
