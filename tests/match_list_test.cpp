// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/match_list.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

using Matches = std::vector<ReportedMatch>;
using Times = std::vector<std::optional<double>>;

class MatchListTest : public test::ScratchTest {
 protected:
  [[nodiscard]] MatchList read(std::string_view text) const {
    return read_match_list(write("matches.csv", text));
  }
};

TEST_F(MatchListTest, ReadsWhatARunLeaves) {
  const MatchList list = read(
      "frame,timestamp,status,match,score,similarity\n"
      "0,,no_earlier_place,,0,0\n"
      "1,0.100000,low_score,0,0.25,0.4\n"
      "2,0.200000,unreadable,,0,0\n"
      "3,0.300000,loop,0,12.5,0.6\n");
  EXPECT_EQ(list.matches, (Matches{{1, 0, 0.25, false}, {3, 0, 12.5, true}}));
  EXPECT_EQ(list.times_s, (Times{{}, 0.1, 0.2, 0.3}));
}

TEST_F(MatchListTest, FramesWithoutTimesAreCountedAllTheSame) {
  const MatchList list = read("frame,match\n0,\n1,0\n");
  EXPECT_EQ(list.matches, (Matches{{1, 0, 1, true}}));
  EXPECT_EQ(list.times_s, (Times{{}, {}}));
}

TEST_F(MatchListTest, ReadsColumnsInAnyOrderAndPassesOverOthers) {
  const MatchList list = read("score,note,match,query\n0.5,so so,3,40\n");
  EXPECT_EQ(list.matches, (Matches{{40, 3, 0.5, true}}));
  EXPECT_TRUE(list.times_s.empty());
}

TEST_F(MatchListTest, ReadsRowsWithoutNames) {
  EXPECT_EQ(read("40,3\n41,\n42,5\n").matches, (Matches{{40, 3, 1, true}, {42, 5, 1, true}}));
  EXPECT_EQ(read("40,3,-2e-3\n40,7,9\n").matches,
            (Matches{{40, 3, -0.002, true}, {40, 7, 9, true}}));
  EXPECT_EQ(read("40 3 5\n").matches, (Matches{{40, 3, 5, true}}));
}

TEST_F(MatchListTest, PassesOverCommentsBlankLinesAndMarks) {
  const MatchList list =
      read("\xEF\xBB\xBF# by a peer\r\n\r\nquery , match\r\n40 , 3\r\n# 41,4\r\n42,5");
  EXPECT_EQ(list.matches, (Matches{{40, 3, 1, true}, {42, 5, 1, true}}));
}

TEST_F(MatchListTest, LoopsIntoOtherRecordingsAreKnown) {
  const MatchList list =
      read("frame,status,match\n0,loop,1:7\n1,low_score,1:8\n2,loop,0\n3,no_geometry,\n");
  EXPECT_EQ(list.matches, (Matches{{2, 0, 1, true}}));
  EXPECT_EQ(list.elsewhere, (std::vector<int>{0}));
}

TEST_F(MatchListTest, AMatchIsAnEarlierFrame) {
  for (const char* row : {"5,5\n", "5,6\n"}) {
    test::expect_error(ErrorKind::input, {"line 1", "earlier"}, [&] { (void)read(row); });
  }
}

TEST_F(MatchListTest, NothingIsAListToo) {
  EXPECT_TRUE(read("").matches.empty());
  EXPECT_TRUE(read("query,match\n").matches.empty());
}

TEST_F(MatchListTest, BadRowsNameFileAndLine) {
  const std::string named = "query,match,score\n";
  const std::string frames = "frame,timestamp,match\n";
  for (const auto& [head, row] :
       std::vector<std::pair<std::string, std::string>>{{named, "40,x,1"},
                                                        {named, "-40,3,1"},
                                                        {named, "40,-3,1"},
                                                        {named, "40,-1,1"},
                                                        {named, ",3,1"},
                                                        {named, "40,3,nan"},
                                                        {named, "40,3,inf"},
                                                        {named, "40,3,1e999"},
                                                        {named, "40,3,"},
                                                        {named, "40,3"},
                                                        {named, "40,3,1,1"},
                                                        {named, "40.5,3,1"},
                                                        {named, "99999999999,3,1"},
                                                        {"40,3\n", "query,match"},
                                                        {frames, "1,0.1,"},
                                                        {frames, "0,x,"}}) {
    SCOPED_TRACE(row);
    const std::string file = write("matches.csv", head + row + "\n");
    test::expect_error(ErrorKind::input, {file, "line 2", row}, [&] { read_match_list(file); });
  }
}

TEST_F(MatchListTest, AMissingFrameIsNoticed) {
  const std::string file = write("matches.csv", "frame,match\n0,\n1,\n3,0\n");
  test::expect_error(ErrorKind::input, {file, "line 4", "frame 2 "},
                     [&] { read_match_list(file); });
}

TEST_F(MatchListTest, BadNamesAreNamed) {
  for (const auto& [names, fault] : std::vector<std::pair<std::string, std::string>>{
           {"query,score", "no column 'match'"},
           {"match,score", "no column 'query'"},
           {"query,match,match", "'match' twice"},
           {"frame,query,match", "both 'frame' and 'query'"},
           {"a,b", "no column 'match'"}}) {
    SCOPED_TRACE(names);
    const std::string file = write("matches.csv", names + "\n1,2,3\n");
    test::expect_error(ErrorKind::input, {file, "line 1", fault}, [&] { read_match_list(file); });
  }
  for (const char* row : {"40", "40,3,1,1", "40,name"}) {
    SCOPED_TRACE(row);
    const std::string file = write("matches.csv", row);
    test::expect_error(ErrorKind::input, {file, "line 1", row}, [&] { read_match_list(file); });
  }
  const std::string missing = path("nothing.csv");
  test::expect_error(ErrorKind::input, {missing}, [&] { read_match_list(missing); });
}

TEST(RealMatches, ReadsAPublishedList) {
  LOOPBIT_NEEDS_DATA("truth/published");
  const auto file = test::data_dir().value() / "truth/published/ibow_lcd_city_centre.csv";
  const MatchList list = read_match_list(file.string());
  ASSERT_EQ(list.matches.size(), 495U);
  EXPECT_EQ(list.matches.front(), (ReportedMatch{679, 157, 38, true}));
  EXPECT_TRUE(list.times_s.empty());
}

}  // namespace
}  // namespace loopbit
