// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Maps that are cut, flipped or too large for their disk: whatever is read of them is true.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "loopbit/map_tools.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 120;

struct Outcomes {
  int files = 0;
  int refused = 0;  ///< with an Error
  int partial = 0;  ///< opened, with damage told
  int whole = 0;    ///< opened, and nothing is missing
};

class MapDamage : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    add_session(path("map.db"), kFrames - 20, "first", std::nullopt, encode_image);
    MapWriter map(path("map.db"), fast_options(), "second", encode_image);
    for (int frame = 0; frame < 19; ++frame) add_frame(map, frame);
    add_frame(map, 19, SessionFrame{1, 2});
    map.add_pose({.query = {0, 19}, .match = {1, 2}, .measured = motion_of(19)});
    map.finish();
    bytes_ = read_bytes(path("map.db"));
  }

  /// Reads `bytes` as a map. All that is given must be true, and what is lost must be told.
  void judge(const std::string& bytes, const std::string& what) {
    const std::string file = write("damaged.db", bytes);
    ++outcomes_.files;
    try {
      const MapCheck check = check_map(file);
      MapReader map(file);
      expect_only_true_places(map);
      for (const MapLoop& loop : map.loops()) {
        EXPECT_EQ(loop, (MapLoop{{2, 19}, {1, 2}, 0.995, 0.25, 40, 31})) << what;
      }
      for (const KnownMotion& motion : map.motions_of({{{2, 19}, {1, 2}}})) {
        if (motion.known == PoseKnown::nothing) continue;
        EXPECT_EQ(motion.motion.T_from_to, motion_of(19).motion.T_from_to) << what;
        EXPECT_EQ(motion.motion.covariance, motion_of(19).motion.covariance) << what;
      }
      const bool whole = map.odometry().size() == kFrames && map.loop_poses().size() == 1 &&
                         check.places == kFrames && check.images == kFrames && check.loops == 1 &&
                         check.sessions == 2;
      EXPECT_TRUE(whole || !check.damage.empty()) << what << " is not told";
      ++(whole ? outcomes_.whole : outcomes_.partial);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input) << what << ": " << error.what();
      EXPECT_NE(std::string(error.what()).find(file), std::string::npos) << error.what();
      ++outcomes_.refused;
    }
  }

  void TearDown() override {
    if (outcomes_.files > 0) {
      std::cout << outcomes_.files << " files: " << outcomes_.refused << " refused, "
                << outcomes_.partial << " read in part, " << outcomes_.whole << " whole\n";
    }
    ScratchTest::TearDown();
  }

  std::string bytes_;
  Outcomes outcomes_;
};

/// More, where the environment variable LOOPBIT_DAMAGED_FILES says so.
int number_of_files() {
  const char* number = std::getenv("LOOPBIT_DAMAGED_FILES");
  return number ? std::atoi(number) : 60;
}

TEST_F(MapDamage, FlippedBitsAnywhere) {
  Random random;
  for (int i = 0; i < number_of_files(); ++i) {
    std::string damaged = bytes_;
    const int flips = i % 3 == 0 ? 20 : 1;
    for (int flip = 0; flip < flips; ++flip) {
      const int at = random.between(0, static_cast<int>(bytes_.size()) - 1);
      damaged[static_cast<std::size_t>(at)] ^= static_cast<char>(1 << random.between(0, 7));
    }
    judge(damaged, std::to_string(i));
  }
  EXPECT_GT(outcomes_.partial, number_of_files() / 10);
}

TEST_F(MapDamage, CutAnywhere) {
  const std::size_t stride = bytes_.size() / static_cast<std::size_t>(number_of_files()) + 1;
  for (std::size_t size = 0; size < bytes_.size(); size += stride) {
    judge(bytes_.substr(0, size), std::to_string(size));
  }
  EXPECT_EQ(outcomes_.whole, 0);
}

TEST_F(MapDamage, PagesOverwritten) {
  constexpr std::size_t kPage = 16384;
  for (std::size_t at = 0; at < bytes_.size(); at += kPage) {
    std::string damaged = bytes_;
    std::fill_n(damaged.begin() + static_cast<std::ptrdiff_t>(at), kPage, '\x5a');
    judge(damaged, std::to_string(at));
  }
  EXPECT_GT(outcomes_.partial, 3);
}

TEST_F(MapDamage, WhatIsBehindADamagedPageIsRecovered) {
  // A page of contents, found by one of them.
  const BinaryContent content = content_of(50);
  const std::string needle(reinterpret_cast<const char*>(content.rows.data()), 512);
  const std::size_t at = bytes_.find(needle);
  ASSERT_NE(at, std::string::npos);
  std::fill_n(bytes_.begin() + static_cast<std::ptrdiff_t>(at / 16384 * 16384), 16384, '\0');
  const std::string file = write("damaged.db", bytes_);
  const MapCheck check = recover_map(file, path("recovered.db"));
  EXPECT_GE(check.places, kFrames - 30);
  EXPECT_LT(check.places, kFrames);
  EXPECT_EQ(check.sessions, 2);
  EXPECT_FALSE(check.damage.empty());
  EXPECT_TRUE(check_map(path("recovered.db")).damage.empty());
  MapReader recovered(path("recovered.db"));
  expect_only_true_places(recovered);
}

TEST_F(MapDamage, AMapWithoutItsFirstPageIsRecovered) {
  std::fill_n(bytes_.begin(), 16384, '\x5a');
  const std::string file = write("damaged.db", bytes_);
  expect_error(ErrorKind::input, {file, "check"}, [&] { const MapReader map(file); });
  const MapCheck check = recover_map(file, path("recovered.db"));
  EXPECT_EQ(check.places, kFrames);
  EXPECT_EQ(check.images, kFrames);
  EXPECT_EQ(check.sessions, 2);
  EXPECT_EQ(check.loops, 1);
  EXPECT_EQ(check.damage.size(), 1U);
  EXPECT_FALSE(fs::exists(path("recovered.db.part")));
  EXPECT_FALSE(fs::exists(path("recovered.db.part.repaired")));
  MapReader recovered(path("recovered.db"));
  EXPECT_EQ(recovered.odometry().size(), std::size_t{kFrames});
  EXPECT_EQ(recovered.loop_poses().size(), 1U);
  expect_only_true_places(recovered);
}

TEST_F(MapDamage, WhatIsNoMapIsNotRecovered) {
  Random random;
  std::string noise(100'000, '\0');
  for (char& byte : noise) byte = static_cast<char>(random.between(0, 255));
  change(path("other.db"), "CREATE TABLE stranger (x); INSERT INTO stranger VALUES (1)");
  for (const std::string& file :
       {write("noise.db", noise), write("zeros.db", std::string(100'000, '\0')),
        write("short.db", "no map"), path("other.db"), path("none.db")}) {
    expect_error(ErrorKind::input, {file}, [&] { recover_map(file, path("new.db")); });
    for (const char* left : {"new.db", "new.db.part", "new.db.lock"}) {
      EXPECT_FALSE(fs::exists(path(left))) << file << " leaves " << left;
    }
  }
}

/// A limit on the size of files, as a full disk would be.
class FullDisk {
 public:
  explicit FullDisk(std::uintmax_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  FullDisk(FullDisk&&) = delete;
  FullDisk& operator=(FullDisk&&) = delete;

 private:
  rlimit before_{};
};

TEST_F(MapDamage, AFullDiskIsToldAndCostsNothingSaved) {
  std::int64_t saved = 0;
  {
    MapWriter map(path("map.db"), fast_options(), "third");
    const FullDisk disk(fs::file_size(path("map.db")) + 100'000);
    expect_error(ErrorKind::output, {path("map.db"), "free space", "kept"}, [&] {
      for (int frame = 0;; ++frame) {
        add_frame(map, frame);
        if (frame % 50 == 49) map.flush();
      }
    });
    saved = map.saved_frames();
    EXPECT_GT(saved, 0);
    expect_error(ErrorKind::output, {path("map.db")}, [&] { add_frame(map, 0); });
    expect_error(ErrorKind::output, {path("map.db")}, [&] { map.finish(); });
  }
  MapReader map(path("map.db"));
  EXPECT_EQ(static_cast<std::int64_t>(places_of(map).size()), kFrames + saved);
  expect_only_true_places(map);
  EXPECT_TRUE(check_map(path("map.db")).damage.empty());
  add_session(path("map.db"), 3, "fourth");
}

TEST_F(MapDamage, ARecoveryReplacesNoLink) {
  fs::create_symlink("nowhere", path("link.db"));
  expect_error(ErrorKind::output, {"link.db' exists"},
               [&] { recover_map(path("map.db"), path("link.db")); });
  EXPECT_TRUE(fs::is_symlink(path("link.db")));
}

TEST_F(MapDamage, ARecoveryThatFindsNoSpaceLeavesNothing) {
  {
    const FullDisk disk(fs::file_size(path("map.db")) / 2);
    expect_error(ErrorKind::output, {path("new.db")},
                 [&] { recover_map(path("map.db"), path("new.db")); });
  }
  EXPECT_FALSE(fs::exists(path("new.db")));
  EXPECT_EQ(recover_map(path("map.db"), path("new.db")).places, kFrames);
}

TEST_F(MapDamage, WhatARecoveryLeftBehindDoesNotStopTheNext) {
  // The log of a map that was removed, and what a kill leaves.
  {
    MapWriter map(path("removed.db"), fast_options(), "drive");
    add_frame(map, 0);
    map.flush();
    fs::copy_file(path("removed.db-wal"), path("new.db-wal"));
    fs::copy_file(path("removed.db-shm"), path("new.db-shm"));
  }
  for (const char* left : {"new.db.part", "new.db.part-wal", "new.db.part-journal",
                           "new.db-journal", "new.db.part.repaired"}) {
    (void)write(left, std::string(100'000, 'x'));
  }
  EXPECT_EQ(recover_map(path("map.db"), path("new.db")).places, kFrames);
  EXPECT_EQ(places_of(path("new.db")).size(), std::size_t{kFrames});
  EXPECT_TRUE(check_map(path("new.db")).damage.empty());
  EXPECT_FALSE(fs::exists(path("new.db-wal")));
  EXPECT_FALSE(fs::exists(path("new.db.part")));
}

TEST_F(MapDamage, AMapThatCannotBeMadeIsNamed) {
  expect_error(ErrorKind::output, {path("none/map.db")},
               [&] { const MapWriter map(path("none/map.db"), fast_options(), "drive"); });
}

}  // namespace
}  // namespace loopbit::test
