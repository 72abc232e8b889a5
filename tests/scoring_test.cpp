// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/scoring.hpp"

#include <functional>
#include <string>

#include "test_support.hpp"

namespace loopbit {
namespace {

class ScoringTest : public test::ScratchTest {
 protected:
  [[nodiscard]] ScoringRequest request() {
    return {.truth = write("truth.csv", "10,2\n12,4\n"), .names = kFlags};
  }

  static constexpr ScoringNames kFlags{.truth = "--truth",
                                       .ignore = "--ignore",
                                       .protocol = "--protocol",
                                       .tolerance_frames = "--tolerance",
                                       .poses = "--truth-set",
                                       .views = "--truth-views"};
};

TEST_F(ScoringTest, FilesComeBeforeWhatIsKnown) {
  const Scoring known{.truth = GroundTruth{.same_place = {{7, 1, 1}}},
                      .evaluation = {.tolerance_frames = 3, .protocol = "of old"}};
  ScoringRequest by_file = request();
  by_file.not_false = write("near.csv", "11,5\n");
  by_file.ignore = write("ignore.csv", "13\n");
  const Scoring scoring = by_file.resolve({.every = 2}, known);
  EXPECT_EQ(scoring.truth->same_place, (std::vector<PlaceRun>{{10, 2, 2}, {12, 4, 4}}));
  EXPECT_EQ(scoring.truth->near_place, (std::vector<PlaceRun>{{11, 5, 5}}));
  EXPECT_EQ(scoring.truth->ignored, (std::vector<int>{13}));
  EXPECT_EQ(scoring.truth->every, 2);
  EXPECT_EQ(scoring.evaluation.tolerance_frames, 0);
  EXPECT_EQ(scoring.evaluation.protocol, "");

  const Scoring again = ScoringRequest{}.resolve({}, known);
  EXPECT_EQ(again.truth->same_place, known.truth->same_place);
  EXPECT_EQ(again.evaluation.protocol, "of old");
  EXPECT_EQ(again.evaluation.tolerance_frames, 3);
  const Scoring wider = ScoringRequest{.tolerance_frames = 5}.resolve({}, known);
  EXPECT_EQ(wider.evaluation.tolerance_frames, 5);
  EXPECT_EQ(wider.evaluation.protocol, "");
  EXPECT_FALSE(ScoringRequest{}.resolve({}).truth.has_value());
}

TEST_F(ScoringTest, AProtocolFixesTheRest) {
  ScoringRequest by_poses{.truth = write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n"),
                          .protocol = "kitti"};
  EXPECT_EQ(by_poses.resolve({.times_s = FrameTimes(1)}).evaluation.protocol, "kitti");
  EXPECT_EQ(by_poses.poses_file(), by_poses.truth);
  EXPECT_NE(by_poses.description().find("at most 6 m and more than 150 frames"), std::string::npos);
}

TEST_F(ScoringTest, ErrorsCallAFieldWhatTheCallerCallsIt) {
  const auto refuses = [&](const std::function<void(ScoringRequest&)>& change,
                           std::initializer_list<std::string_view> words) {
    ScoringRequest changed = request();
    change(changed);
    test::expect_error(ErrorKind::option, words, [&] { (void)changed.resolve({}); });
    test::expect_error(ErrorKind::option, words, [&] { changed.check({}); });
  };
  refuses([](auto& r) { r.tolerance_frames = -1; }, {"--tolerance is -1"});
  refuses([](auto& r) { r.protocol = "nobody"; }, {"no protocol 'nobody'"});
  refuses([](auto& r) { r.protocol = "kitti"; }, {"--protocol kitti requires poses", "truth.csv"});
  refuses([](auto& r) { r.views = 2; }, {"--truth-views applies to a loop matrix", "truth.csv"});
  refuses([](auto& r) { r.poses.emplace(); }, {"--truth-set applies to poses"});
  refuses(
      [](auto& r) {
        r.protocol = "kitti";
        r.tolerance_frames = 1;
      },
      {"--tolerance cannot be given with --protocol kitti"});
  refuses(
      [](auto& r) {
        r.ignore = "ignore.csv";
        r.truth.clear();
      },
      {"--ignore applies to a file of truth; give --truth"});
  refuses(
      [](auto& r) {
        r.protocol = "kitti";
        r.truth.clear();
      },
      {"--protocol applies to a file of truth"});
}

}  // namespace
}  // namespace loopbit
