// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/ground_truth.hpp"

#include <array>

#include "loopbit/evaluation.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

class GroundTruthTest : public test::ScratchTest {};

TEST_F(GroundTruthTest, ReadsRunsAndPassesOverComments) {
  const std::string file = write("truth.csv", "# query,first,last\n\n40,0,2\r\n41 , 1 , 3 \n");
  EXPECT_EQ(read_place_runs(file), (std::vector<PlaceRun>{{40, 0, 2}, {41, 1, 3}}));
}

TEST_F(GroundTruthTest, ReadsWhatItWrote) {
  const std::vector<PlaceRun> runs{{40, 0, 2}, {40, 7, 7}, {1000000, 0, 999999}};
  write_place_runs(path("truth.csv"), "made by a test", runs);
  EXPECT_EQ(read_place_runs(path("truth.csv")), runs);
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
  const std::string list = write("ignore.csv", "wall\n");
  test::expect_error(ErrorKind::input, {list, "1", "wall"}, [&] { read_frame_list(list); });
}

TEST_F(GroundTruthTest, MissingAndUnwritableFilesAreNamed) {
  const std::string missing = path("nothing.csv");
  test::expect_error(ErrorKind::input, {missing}, [&] { read_place_runs(missing); });
  const std::string nowhere = path("no/folder.csv");
  test::expect_error(ErrorKind::output, {nowhere}, [&] { write_place_runs(nowhere, "", {}); });
}

Detection detection(PlaceId frame, Status status, std::optional<PlaceId> match) {
  return {.frame = frame, .status = status, .match = match};
}

TEST(CountDecisions, TellsRightToleratedWrongMissedAndIgnored) {
  const GroundTruth truth{{{10, 0, 2}, {11, 1, 3}, {12, 2, 4}, {13, 3, 5}, {13, 8, 8}, {14, 4, 6}},
                          {{11, 0, 5}, {15, 0, 1}},
                          {14}};
  const std::array detections{
      detection(9, Status::loop, 0),        // no such place: wrong
      detection(10, Status::loop, 2),       // right
      detection(11, Status::loop, 5),       // near: tolerated, and the revisit is missed
      detection(12, Status::low_score, 3),  // the right match, but not accepted: missed
      detection(13, Status::loop, 8),       // right by its second run
      detection(14, Status::loop, 0),       // ignored, else wrong
      detection(15, Status::loop, 1),       // no revisit, but near
      detection(16, Status::unreadable, std::nullopt),
  };
  const DecisionCounts counts = count_decisions(detections, truth);
  EXPECT_EQ(counts.positives, 4);
  EXPECT_EQ(counts.right, 2);
  EXPECT_EQ(counts.tolerated, 2);
  EXPECT_EQ(counts.wrong, 1);
  EXPECT_EQ(counts.ignored, 1);
  EXPECT_DOUBLE_EQ(counts.recall(), 0.5);
  EXPECT_DOUBLE_EQ(counts.precision(), 2.0 / 3.0);
}

TEST(CountDecisions, NothingFoundIsPreciseAndHasNoRecall) {
  const DecisionCounts counts = count_decisions({}, {});
  EXPECT_EQ(counts.recall(), 0.0);
  EXPECT_EQ(counts.precision(), 1.0);
}

}  // namespace
}  // namespace loopbit
