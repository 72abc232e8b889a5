// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Maps on a PostgreSQL server. Needs the address of one in LOOPBIT_FLEET_ADDRESS, with a superuser;
// fleet_command_test.py starts one.
#include "loopbit/fleet_map.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <libpq-fe.h>

#include "loopbit/error.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/map_tools.hpp"

#include "file_database.hpp"
#include "map_follower.hpp"
#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

class FleetMap : public ScratchTest {
 protected:
  static void SetUpTestSuite() { use_fleet_maps(); }

  void SetUp() override {
    ScratchTest::SetUp();
    sql("SET client_min_messages = warning; DROP SCHEMA IF EXISTS loopbit CASCADE");
    ASSERT_TRUE(create_map(address));
  }

  /// The first value of what the statements give.
  std::string sql(const std::string& statements, const std::string& at = "") const {
    const std::unique_ptr<PGconn, decltype(&PQfinish)> connection(
        PQconnectdb((at.empty() ? address : at).c_str()), PQfinish);
    const std::unique_ptr<PGresult, decltype(&PQclear)> result(
        PQexec(connection.get(), statements.c_str()), PQclear);
    EXPECT_LE(PQresultStatus(result.get()), PGRES_TUPLES_OK) << PQerrorMessage(connection.get());
    return PQntuples(result.get()) > 0 ? PQgetvalue(result.get(), 0, 0) : "";
  }

  /// Another map, whose sessions count from 101.
  std::string second_address() const {
    std::string second = address;
    second.replace(second.rfind('/') + 1, std::string::npos, "other");
    sql("DROP DATABASE IF EXISTS other WITH (FORCE)");
    sql("CREATE DATABASE other");
    EXPECT_TRUE(create_map(second, 101));
    return second;
  }

  std::string address = std::getenv("LOOPBIT_FLEET_ADDRESS");
};

/// What a robot learns until it has so many places of others.
MapNews learn(MapWriter& map, std::size_t places) {
  MapNews all;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (all.places.size() < places && std::chrono::steady_clock::now() < end) {
    const MapNews news = map.news();
    all.places.insert(all.places.end(), news.places.begin(), news.places.end());
    all.loops.insert(all.loops.end(), news.loops.begin(), news.loops.end());
  }
  EXPECT_EQ(all.places.size(), places);
  return all;
}

TEST_F(FleetMap, KeepsWhatWasWritten) {
  add_session(address, 70, "first", std::nullopt, encode_image);
  add_session(address, 3,
              "s\xe9"
              "cond \n",
              SessionFrame{1, 5});
  MapReader map(address);
  ASSERT_EQ(map.sessions().size(), 2U);
  EXPECT_EQ(map.sessions()[1].name,
            "s\xe9"
            "cond \n");
  EXPECT_TRUE(map.sessions()[1].linked);
  EXPECT_EQ(map.sessions()[0].frames, 70);
  expect_only_true_places(map);
  EXPECT_EQ(map.images().number, 70);
  ASSERT_EQ(map.loops().size(), 1U);
  EXPECT_EQ(map.loops()[0].query, (SessionFrame{2, 2}));
  EXPECT_EQ(map.loops()[0].match, (SessionFrame{1, 5}));
  EXPECT_GT(map.bytes(), 70 * 512);
  EXPECT_TRUE(map.damage().empty());
}

TEST_F(FleetMap, ReadsMorePlacesThanItHoldsAtOnce) {
  add_session(address, 2500);
  const auto places = places_of(address);
  ASSERT_EQ(places.size(), 2500U);
  for (int frame = 0; frame < 2500; ++frame) {
    EXPECT_EQ(places[static_cast<std::size_t>(frame)].at, (SessionFrame{1, frame}));
  }
}

TEST_F(FleetMap, RobotsWriteAtOnceAndSeeWhatWasCommittedBefore) {
  add_session(address, 5);
  MapWriter one(address, fast_options(), "one");
  add_frame(one, 0);
  one.flush();
  MapWriter two(address, fast_options(), "two");
  add_frame(one, 1);
  one.flush();
  EXPECT_EQ(one.session(), 2);
  EXPECT_EQ(two.session(), 3);
  std::vector<SessionFrame> seen;
  two.for_each_earlier_place(
      [&](const SessionFrame& at, const BinaryContent&) { seen.push_back(at); });
  EXPECT_EQ(seen.size(), 6U);  // not frame 1 of `one`
  EXPECT_EQ(seen.back(), (SessionFrame{2, 0}));
  add_frame(two, 0);
  one.finish();
  two.finish();
  MapReader map(address);
  ASSERT_EQ(map.sessions().size(), 3U);
  EXPECT_TRUE(map.sessions()[1].linked);
  EXPECT_FALSE(map.sessions()[2].linked);  // `one` went on
  EXPECT_EQ(places_of(map).size(), 8U);
  expect_only_true_places(map);
}

TEST_F(FleetMap, PlacesHaveTheEpochOfTheirCommit) {
  MapWriter one(address, fast_options(), "one");
  MapWriter two(address, fast_options(), "two");
  for (int frame = 0; frame < 3; ++frame) {
    for (MapWriter* writer : {&two, &one}) {
      add_frame(*writer, frame);
      writer->flush();
    }
  }
  EXPECT_EQ(sql("SELECT string_agg(epoch || ':' || session || '.' || frame, ' ' ORDER BY epoch) "
                "FROM loopbit.place JOIN loopbit.batch USING (batch)"),
            "1:2.0 2:1.0 3:2.1 4:1.1 5:2.2 6:1.2");
}

TEST_F(FleetMap, ASessionIsNotLinkedOnceAnEarlierOneGrows) {
  // After a crash of the server, nothing shows that `one` is being written.
  const auto forget = [&] {
    sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = "
        "'loopbit'");
  };
  MapWriter one(address, fast_options(), "one");
  add_frame(one, 0);
  one.flush();
  forget();
  MapWriter two(address, fast_options(), "two");
  add_frame(two, 0);
  two.flush();
  EXPECT_EQ(sql("SELECT string_agg(session::text, ' ') FROM loopbit.linked"), "1 2");
  forget();
  MapWriter three(address, fast_options(), "three");
  add_frame(one, 1);
  one.flush();
  EXPECT_EQ(sql("SELECT string_agg(session::text, ' ') FROM loopbit.linked"), "1");
  add_frame(three, 0);
  three.flush();
  EXPECT_EQ(sql("SELECT string_agg(session::text, ' ') FROM loopbit.linked"), "1");
  EXPECT_GT(one.reconnections(), 0);
}

TEST_F(FleetMap, ARobotLearnsWhatOthersAddMeanwhile) {
  add_session(address, 5);
  MapWriter me(address, fast_options(), "me");
  me.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  me.for_each_earlier_loop([](const SessionFrame&, const SessionFrame&) {});
  EXPECT_EQ(me.epoch(), 1);
  add_frame(me, 0);
  me.flush();
  MapWriter other(address, fast_options(), "other");
  MapNews all;
  const auto learn_until = [&](std::int64_t epoch) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (all.epoch < epoch && std::chrono::steady_clock::now() < end) {
      const MapNews news = me.news();
      all.epoch = news.epoch;
      all.places.insert(all.places.end(), news.places.begin(), news.places.end());
      all.loops.insert(all.loops.end(), news.loops.begin(), news.loops.end());
      all.rejected.insert(all.rejected.end(), news.rejected.begin(), news.rejected.end());
    }
    EXPECT_EQ(all.epoch, epoch);
  };
  for (int frame = 0; frame < 3; ++frame) {
    add_frame(other, frame, frame == 1 ? std::optional(SessionFrame{2, 0}) : std::nullopt);
    other.flush();
  }
  learn_until(5);
  ASSERT_EQ(all.places.size(), 3U);
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_EQ(all.places[static_cast<std::size_t>(frame)].at, (SessionFrame{3, frame}));
    EXPECT_EQ(all.places[static_cast<std::size_t>(frame)].content, content_of(frame));
    EXPECT_TRUE(same_features(*me.features(-1 - frame), few_features(frame)));
  }
  ASSERT_EQ(all.loops.size(), 1U);
  EXPECT_EQ(all.loops[0].query, (SessionFrame{3, 1}));
  EXPECT_EQ(all.loops[0].match, (SessionFrame{0, 0}));
  other.reject({0, 1}, {2, 0});
  other.flush();
  learn_until(6);
  EXPECT_EQ(all.rejected.size(), 1U);
  sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = 'loopbit'");
  add_frame(other, 3);
  other.flush();
  learn_until(7);
  EXPECT_EQ(all.places.size(), 4U);
  EXPECT_EQ(me.unverified(), 0);
}

TEST_F(FleetMap, ASessionIsNewsAlsoIfTheFirstReadFails) {
  MapWriter other(address, fast_options(), "other");
  add_frame(other, 0);
  other.flush();
  sql("ALTER TABLE loopbit.loop RENAME TO away");
  MapFollower follower(open_map(address, MapDatabase::Access::read), 7, 0, {},
                       [](const MapSession&) {});
  MapFollower::News all;
  const auto take_until = [&](const auto& is_enough) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!is_enough() && std::chrono::steady_clock::now() < end) {
      MapFollower::News news = follower.take();
      std::ranges::move(news.sessions, std::back_inserter(all.sessions));
      std::ranges::move(news.places, std::back_inserter(all.places));
      std::ranges::move(news.notices, std::back_inserter(all.notices));
    }
  };
  take_until([&] { return !all.notices.empty(); });
  EXPECT_TRUE(all.places.empty());
  sql("ALTER TABLE loopbit.away RENAME TO loop");
  take_until([&] { return !all.places.empty(); });
  EXPECT_EQ(all.places.size(), 1U);
  ASSERT_EQ(all.sessions.size(), 1U);
  EXPECT_EQ(all.sessions[0].session, other.session());
}

TEST_F(FleetMap, ARobotRecognisesPlacesOfSeveralServers) {
  const std::string other = second_address();
  add_session(other, 4, "far", SessionFrame{101, 0});
  add_session(address, 5, "near", SessionFrame{1, 0});
  MapWriter me(address + " " + other, fast_options(), "me", {}, 0);
  EXPECT_EQ(me.session(), 2);
  std::vector<SessionFrame> seen;
  me.for_each_earlier_place(
      [&](const SessionFrame& at, const BinaryContent&) { seen.push_back(at); });
  ASSERT_EQ(seen.size(), 9U);
  EXPECT_EQ(seen[4], (SessionFrame{1, 4}));
  EXPECT_EQ(seen[5], (SessionFrame{101, 0}));
  std::vector<int> sessions;
  me.for_each_earlier_loop(
      [&](const SessionFrame& query, const SessionFrame&) { sessions.push_back(query.session); });
  EXPECT_EQ(sessions, (std::vector{1, 101}));
  EXPECT_EQ(me.epoch(), 0);
  EXPECT_TRUE(same_features(*me.features(2), few_features(2)));
  EXPECT_TRUE(same_features(*me.features(8), few_features(3)));
  expect_error(ErrorKind::option, {"Session 101", "only read"}, [&] { me.remove(8); });
  expect_error(ErrorKind::option, {"Session 101", "only read"}, [&] {
    me.reject({101, 3}, {101, 0});
  });

  MapWriter robot(other, fast_options(), "robot");
  for (int frame = 0; frame < 3; ++frame) {
    add_frame(robot, frame, frame == 1 ? std::optional(SessionFrame{101, 0}) : std::nullopt);
  }
  robot.finish();
  const MapNews news = learn(me, 3);
  EXPECT_EQ(news.epoch, 0);
  EXPECT_EQ(news.places[2].at, (SessionFrame{102, 2}));
  EXPECT_EQ(news.loops.size(), 1U);
  move_sessions(other, address, {102});
  MapWriter next(address, fast_options(), "next");  // whose place comes after those that were moved
  add_frame(next, 0);
  next.finish();
  EXPECT_EQ(learn(me, 1).places[0].at, (SessionFrame{3, 0}));
  EXPECT_TRUE(same_features(*me.features(-3), few_features(2)));

  add_frame(me, 0, SessionFrame{101, 3});
  me.finish();
  EXPECT_EQ(me.unverified(), 0);
  EXPECT_TRUE(me.not_asked().empty());
  MapReader map(address);
  EXPECT_EQ(map.sessions().size(), 4U);
  EXPECT_TRUE(map.sessions()[1].linked);
  EXPECT_EQ(map.loops().back().match, (SessionFrame{101, 3}));
  EXPECT_EQ(check_map(address).damage, std::vector<std::string>{});
}

TEST_F(FleetMap, AQueueWithLoopsToAnotherServerIsMerged) {
  const std::string other = second_address();
  add_session(other, 4, "far");
  MapWriter map(address + " " + other, fast_options(), "second");
  map.set_queue(path("queue.db"));
  map.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  map.for_each_earlier_loop([](const SessionFrame&, const SessionFrame&) {});
  sql("ALTER TABLE loopbit.place ADD CONSTRAINT is_full CHECK (false) NOT VALID");
  add_frame(map, 0, SessionFrame{101, 3});
  map.finish();
  ASSERT_EQ(map.queue(), path("queue.db"));
  sql("ALTER TABLE loopbit.place DROP CONSTRAINT is_full");
  const MergeCounts counts = merge_map(address, map.queue());
  EXPECT_EQ(counts.sessions, 1);
  EXPECT_EQ(counts.loops, 1);
  MapReader merged(address);
  ASSERT_EQ(merged.sessions().size(), 1U);
  ASSERT_EQ(merged.loops().size(), 1U);
  EXPECT_EQ(merged.loops()[0].match, (SessionFrame{101, 3}));
}

TEST_F(FleetMap, AServerThatIsAwayIsNamed) {
  const std::string other = second_address();
  add_session(address, 3);
  add_session(other, 4);
  const std::string away = "postgresql://robot:secret@127.0.0.1:1/town";
  MapWriter map(fmt::format("{} {} {}", address, away, other), fast_options(), "me", {}, 0);
  ASSERT_EQ(map.take_notices().size(), 1U);
  EXPECT_EQ(map.not_asked(), std::vector<std::string>{"postgresql://robot@127.0.0.1:1/town"});
  std::size_t places = 0;
  map.for_each_earlier_place([&](const SessionFrame&, const BinaryContent&) { ++places; });
  map.for_each_earlier_loop([](const SessionFrame&, const SessionFrame&) {});
  EXPECT_EQ(places, 7U);
  const auto wait_until = [](const auto& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(is_so());
  };
  sql("ALTER DATABASE other WITH ALLOW_CONNECTIONS false");  // committed before they connect again
  sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = 'other'");
  wait_until([&] { return map.features(6)->keypoints.empty(); });
  wait_until([&] {
    map.news();
    return map.not_asked().size() == 2;
  });
  EXPECT_TRUE(same_features(*map.features(2), few_features(2)));
  EXPECT_GT(map.unverified(), 0);
  add_frame(map, 0);
  map.flush();
  sql("ALTER DATABASE other WITH ALLOW_CONNECTIONS true");
  wait_until([&] { return !map.features(6)->keypoints.empty(); });
  add_session(other, 1);
  EXPECT_EQ(learn(map, 1).places[0].at, (SessionFrame{102, 0}));
  EXPECT_EQ(map.take_notices().size(), 2U);  // it is lost, and back
}

TEST_F(FleetMap, AReaderSeesTheMapAsOfAnEpoch) {
  expect_error(ErrorKind::option, {"no epochs yet", "empty"},
               [&] { MapReader(address).set_epoch(1); });
  add_session(address, 5, "first", SessionFrame{1, 0});
  add_session(address, 4, "second", SessionFrame{1, 2});
  const auto seen = [&](MapReader& map) {
    std::size_t places = 0;
    std::size_t loops = 0;
    map.for_each_earlier_place([&](const SessionFrame&, const BinaryContent&) { ++places; });
    map.for_each_earlier_loop([&](const SessionFrame&, const SessionFrame&) { ++loops; });
    return std::pair(places, loops);
  };
  MapReader now(address);
  EXPECT_EQ(seen(now), (std::pair<std::size_t, std::size_t>(9, 2)));
  EXPECT_EQ(now.epoch(), 2);
  MapReader then(address);
  then.set_epoch(1);
  EXPECT_EQ(seen(then), (std::pair<std::size_t, std::size_t>(5, 1)));
  EXPECT_EQ(then.epoch(), 1);
  expect_error(ErrorKind::option, {"1 to 2", "3"}, [&] { now.set_epoch(3); });
  add_session(path("file.db"), 1);
  expect_error(ErrorKind::option, {"file.db", "no epochs"},
               [&] { MapReader(path("file.db")).set_epoch(1); });
}

TEST_F(FleetMap, WhatTheServerDoesNotTakeIsMergedLater) {
  add_session(address, 5);
  sql("CREATE OR REPLACE FUNCTION public.refuse() RETURNS trigger LANGUAGE plpgsql AS $$BEGIN "
      "RAISE "
      "'full' USING ERRCODE = 'disk_full'; END$$");
  MapWriter map(address, fast_options(), "second", encode_image);
  map.set_queue(path("queue.db"));
  map.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  for (int frame = 0; frame < 3; ++frame) add_frame(map, frame, SessionFrame{1, frame});
  map.flush();
  sql("CREATE TRIGGER refuse BEFORE INSERT ON loopbit.place EXECUTE FUNCTION public.refuse()");
  for (int frame = 3; frame < 7; ++frame) add_frame(map, frame, SessionFrame{1, 4});
  map.reject({0, 1}, {1, 1});
  map.reject({0, 6}, {1, 4});
  expect_error(ErrorKind::output, {"full", "free space"}, [&] { map.flush(); });
  EXPECT_TRUE(same_features(*map.features(5 + 4), few_features(4)));
  map.finish();
  EXPECT_EQ(map.saved_frames(), 3);
  ASSERT_EQ(map.queue(), path("queue.db"));
  expect_error(ErrorKind::output, {"full"}, [&] { merge_map(address, map.queue()); });
  sql("DROP TRIGGER refuse ON loopbit.place");
  const MergeCounts counts = merge_map(address, map.queue());
  EXPECT_EQ(counts.continued, 1);
  EXPECT_EQ(counts.sessions, 0);
  EXPECT_EQ(counts.places, 4);
  EXPECT_EQ(counts.loops, 3);
  for (int again = 0; again < 2; ++again) {
    MapReader read(address);
    EXPECT_EQ(read.sessions()[1].frames, 7);
    EXPECT_EQ(places_of(read).size(), 12U);
    expect_only_true_places(read);
    EXPECT_EQ(read.images().number, 7);
    ASSERT_EQ(read.loops().size(), 5U);
    EXPECT_EQ(read.loops()[4].query, (SessionFrame{2, 5}));
    EXPECT_EQ(read.rejected_loops().size(), 2U);
    EXPECT_EQ(read.odometry().size(), 12U);
    EXPECT_EQ(merge_map(address, map.queue()).places, 0);
  }
}

TEST_F(FleetMap, IsCompactedAsAFile) {
  const std::string file = path("town.db");
  for (const std::string& map : {file, address}) {
    add_session(map, 40, "first", std::nullopt, encode_image);
    add_session(map, 30, "second", SessionFrame{1, 5}, encode_image);
    add_session(map, 20, "third", SessionFrame{2, 3}, encode_image);
  }
  const auto expect_same = [&](const CompactOptions& options) {
    const CompactCounts of_file = compact_map(file, options);
    const CompactCounts of_server = compact_map(address, options);
    EXPECT_EQ(of_server.places_before, of_file.places_before);
    EXPECT_EQ(of_server.places_after, of_file.places_after);
    MapReader one(file);
    MapReader other(address);
    const auto expected = places_of(one);
    const auto places = places_of(other);
    ASSERT_EQ(places.size(), expected.size());
    for (std::size_t i = 0; i < places.size(); ++i) EXPECT_EQ(places[i].at, expected[i].at);
    EXPECT_EQ(other.sessions().size(), one.sessions().size());
    EXPECT_EQ(other.loops(), one.loops());
    EXPECT_EQ(other.images().number, one.images().number);
    EXPECT_EQ(check_map(address).damage, std::vector<std::string>{});
    expect_only_true_places(other);
  };
  expect_same({.drop_sessions = {2, 2}});
  expect_same({.drop_sessions = {}, .max_places = 25});
  expect_same({.drop_sessions = {}, .drop_images = true});
  EXPECT_EQ(sql("SELECT count(*) FROM loopbit.features"), "25");
  expect_error(ErrorKind::option, {"session 9"},
               [&] { compact_map(address, {.drop_sessions = {9}}); });
  MapWriter robot(address, fast_options(), "robot");
  expect_error(ErrorKind::output, {"being written"},
               [&] { compact_map(address, {.drop_sessions = {1}}); });
}

TEST_F(FleetMap, RemovesAndRejects) {
  add_session(address, 5, "first", SessionFrame{1, 0});
  MapWriter map(address, fast_options(), "second");
  map.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {});
  map.for_each_earlier_loop([](const SessionFrame&, const SessionFrame&) {});
  map.remove(1);
  map.reject({1, 4}, {1, 0});
  map.reject({1, 3}, {1, 2});
  map.flush();
  EXPECT_TRUE(map.features(1)->keypoints.empty());
  EXPECT_TRUE(same_features(*map.features(2), few_features(2)));
  map.finish();
  MapReader read(address);
  EXPECT_EQ(places_of(read).size(), 4U);
  EXPECT_TRUE(read.loops().empty());
  ASSERT_EQ(read.rejected_loops().size(), 2U);
  EXPECT_EQ(read.rejected_loops()[0].query, (SessionFrame{1, 4}));
  EXPECT_EQ(sql("SELECT count(*) FROM loopbit.features"), "4");
}

TEST_F(FleetMap, OtherSettingsAreRefused) {
  add_session(address, 2);
  LoopDetectorOptions other = fast_options();
  other.surf.max_keypoints += 1;
  expect_error(ErrorKind::option, {"surf.max_keypoints"},
               [&] { MapWriter(address, other, "other"); });
}

TEST_F(FleetMap, ASessionThatIsWrittenIsNeitherMergedNorLinked) {
  const std::string file = path("copy.db");
  {
    MapWriter map(address, fast_options(), "drive");
    add_frame(map, 0);
    map.flush();
    expect_error(ErrorKind::input, {"is being written"}, [&] { merge_map(file, address); });
    expect_error(ErrorKind::output, {"is being written"}, [&] { link_map(address); });
    map.finish();
  }
  EXPECT_EQ(merge_map(file, address).places, 1);
  EXPECT_EQ(merge_map(address, file).known, 1);
}

TEST_F(FleetMap, SecretsAreNotShown) {
  const auto expect_shown = [](const std::string& uri, const std::string& shown) {
    EXPECT_EQ(without_secrets("--map=" + uri), "--map=" + shown);
  };
  expect_shown("postgresql://u:secret@h:5433/d", "postgresql://u@h:5433/d");
  expect_shown("postgres://u:se%40cret@h/d?sslmode=require", "postgresql://u@h/d?sslmode=require");
  expect_shown("postgresql://h/d?user=u&password=secret&sslpassword=secret", "postgresql://u@h/d");
  expect_shown("postgresql://h/d?p%61ssword=secret", "postgresql://h/d");
  expect_shown("postgresql:///d?host=/tmp/a&service=fleet",
               "postgresql://%2Ftmp%2Fa/d?service=fleet");
  for (const char* broken : {"u:sec@ret@h/d", "u:sec/r@et@h/d", "u:1/ret@h/d", "u:%zzsecret@h/d",
                             "h/d?secret", "h:secret/d", "h/d?nothing=secret"}) {
    expect_shown(fmt::format("postgresql://{}", broken), "postgresql://...");
    try {
      const MapReader map(fmt::format("postgresql://{}", broken));
      FAIL() << broken;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("not a valid address"), std::string::npos);
      EXPECT_EQ(std::string(error.what()).find("ret"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace loopbit::test
