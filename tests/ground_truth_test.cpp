// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/ground_truth.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

class GroundTruthTest : public test::ScratchTest {};

TEST_F(GroundTruthTest, ReadsRunsAndPassesOverComments) {
  const std::string file = write("truth.csv", "# query,first,last\n\n40,0,2\r\n41 , 1 , 3 \n");
  EXPECT_EQ(read_place_runs(file), (std::vector<PlaceRun>{{40, 0, 2}, {41, 1, 3}}));
}

TEST_F(GroundTruthTest, ReadsPairsAndPassesOverNames) {
  const std::string pairs = write("truth.csv", "# by hand\nquery,match\n40,2\n40,7\n");
  EXPECT_EQ(read_place_runs(pairs), (std::vector<PlaceRun>{{40, 2, 2}, {40, 7, 7}}));
  const std::string spaced = write("truth.txt", "40 2\n41\t 3\n");
  EXPECT_EQ(read_place_runs(spaced), (std::vector<PlaceRun>{{40, 2, 2}, {41, 3, 3}}));
  const std::string named = write("truth.csv", "Query, First, Last\n40,2,7\n");
  EXPECT_EQ(read_place_runs(named), (std::vector<PlaceRun>{{40, 2, 7}}));
  EXPECT_TRUE(read_place_runs(write("truth.csv", "# no revisit\n")).empty());
  EXPECT_TRUE(read_place_runs(write("truth.csv", "query,match\n")).empty());
}

TEST_F(GroundTruthTest, ReadsWhatItWrote) {
  const std::vector<PlaceRun> runs{{40, 0, 2}, {40, 7, 7}, {1000000, 0, 999999}};
  write_place_runs(path("truth.csv"), "made by a test", runs);
  EXPECT_EQ(read_place_runs(path("truth.csv")), runs);
  write_place_runs(path("truth.csv"), "made by a test", {});
  EXPECT_TRUE(read_place_runs(path("truth.csv")).empty());
}

TEST_F(GroundTruthTest, ReadsFrameListsWithRemarks) {
  EXPECT_EQ(read_frame_list(write("ignore.csv", "45,blank wall\n59\n# 60\n")),
            (std::vector<int>{45, 59}));
}

TEST_F(GroundTruthTest, BadRowsNameFileAndLine) {
  for (const char* row : {"1,2", "1,2,3,4", "1,3,2", "1,2,x", "1,2,-3", "1,2,3x", "a", "1,2,"}) {
    SCOPED_TRACE(row);
    const std::string file = write("truth.csv", std::string("7,1,2\n") + row + "\n");
    test::expect_error(ErrorKind::input, {file, "2", row}, [&] { read_place_runs(file); });
  }
  for (const char* text : {"x,1,2\n", "7\n", "7,1,2,3\n", "7,,2\n"}) {
    SCOPED_TRACE(text);
    const std::string file = write("truth.csv", text);
    test::expect_error(ErrorKind::input, {file, "line 1"}, [&] { read_place_runs(file); });
  }
  const std::string mixed = write("truth.csv", "query,match\n7,1\n7,1,2\n");
  test::expect_error(ErrorKind::input, {mixed, "line 3"}, [&] { read_place_runs(mixed); });
  for (const char* words : {"hello world\n", "hello\n", "query,world\n"}) {
    SCOPED_TRACE(words);
    const std::string file = write("truth.csv", words);
    test::expect_error(ErrorKind::input, {file, "line 1", "query,first,last"},
                       [&] { read_place_runs(file); });
  }
  const std::string list = write("ignore.csv", "wall\n");
  test::expect_error(ErrorKind::input, {list, "1", "wall"}, [&] { read_frame_list(list); });
}

TEST_F(GroundTruthTest, MissingAndUnwritableFilesAreNamed) {
  const std::string missing = path("nothing.csv");
  test::expect_error(ErrorKind::input, {missing}, [&] { read_place_runs(missing); });
  const std::string nowhere = path("no/folder.csv");
  test::expect_error(ErrorKind::output, {nowhere}, [&] { write_place_runs(nowhere, "", {}); });
}

TEST_F(GroundTruthTest, PlacesAreEarlierFramesInTheColumnsTheirNamesSay) {
  for (const char* row : {"5,5\n", "5,6\n", "5,1,5\n"}) {
    test::expect_error(ErrorKind::input, {"line 1", "last < query"},
                       [&] { read_place_runs(write("runs.csv", row)); });
  }
  for (const char* names : {"match,query\n", "first,last,query\n", "query,match,score\n",
                            "query,match,last\n", "frame,place,score\n"}) {
    test::expect_error(ErrorKind::input, {"line 1", "in order"},
                       [&] { read_place_runs(write("runs.csv", names)); });
  }
  EXPECT_EQ(read_place_runs(write("runs.csv", "frame,match\n5,1\n")),
            (std::vector<PlaceRun>{{5, 1, 1}}));
}

TEST(EveryNth, KeepsTheFramesThatWereRead) {
  const GroundTruth truth{
      {{30, 0, 2}, {30, 7, 8}, {31, 0, 9}, {33, 6, 10}}, {{30, 1, 2}, {33, 9, 9}}, {0, 1, 33}};
  const GroundTruth thirds = every_nth(truth, 3);
  EXPECT_EQ(thirds.same_place, (std::vector<PlaceRun>{{10, 0, 0}, {11, 2, 3}}));
  EXPECT_EQ(thirds.near_place, (std::vector<PlaceRun>{{11, 3, 3}}));
  EXPECT_EQ(thirds.ignored, (std::vector<int>{0, 11}));
  EXPECT_EQ(every_nth(truth, 1).same_place, truth.same_place);
  EXPECT_EQ(every_nth({.frames = 10}, 3).frames, 4) << "frames 0, 3, 6 and 9";
  EXPECT_EQ(every_nth({{{2147483646, 0, 2147483647}}, {}, {}}, 2).same_place,
            (std::vector<PlaceRun>{{1073741823, 0, 1073741823}}));
  test::expect_error(ErrorKind::option, {"every is 0"}, [&] { every_nth(truth, 0); });
}

}  // namespace
}  // namespace loopbit
