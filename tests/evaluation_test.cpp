// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/evaluation.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <set>

#include <nlohmann/json.hpp>

#include "loopbit/match_list.hpp"
#include "loopbit/protocol.hpp"
#include "loopbit/truth_file.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::json;

ReportedMatch loop(int query, int match, double score = 1.0) { return {query, match, score, true}; }
ReportedMatch rejected(int query, int match, double score) { return {query, match, score, false}; }

MatchList of_frames(std::vector<ReportedMatch> matches, std::size_t frames) {
  return {std::move(matches), std::vector<std::optional<double>>(frames)};
}

TEST(Evaluate, TellsRightToleratedWrongMissedAndIgnored) {
  const GroundTruth truth{{{10, 0, 2}, {11, 1, 3}, {12, 2, 4}, {13, 3, 5}, {13, 8, 8}, {14, 4, 6}},
                          {{11, 0, 5}, {15, 0, 1}},
                          {14}};
  const MatchList list = of_frames(
      {
          loop(9, 0),            // no such place: wrong
          loop(10, 2),           // right
          loop(11, 5),           // near: tolerated, and the revisit is missed
          rejected(12, 3, 0.5),  // the right match, but not accepted: missed
          loop(13, 8),           // right by its second run
          loop(14, 0),           // ignored, else wrong
          loop(15, 1),           // no revisit, but near
      },
      17);
  const Evaluation evaluation = evaluate(list, truth);
  EXPECT_EQ(evaluation.decision.positives, 4);
  EXPECT_EQ(evaluation.decision.right, 2);
  EXPECT_EQ(evaluation.decision.tolerated, 2);
  EXPECT_EQ(evaluation.decision.wrong, 1);
  EXPECT_EQ(evaluation.decision.ignored, 1);
  EXPECT_DOUBLE_EQ(evaluation.decision.recall(), 0.5);
  EXPECT_DOUBLE_EQ(evaluation.decision.precision(), 2.0 / 3.0);
  EXPECT_EQ(evaluation.wrong_loops, (std::vector<ReportedMatch>{loop(9, 0)}));
  EXPECT_EQ(evaluation.missed, (std::vector<int>{11, 12}));
  EXPECT_EQ(evaluation.pairs.positives, 13);
  EXPECT_EQ(evaluation.pairs.right, 2);
  EXPECT_EQ(evaluation.pairs.wrong, 1);
}

TEST(Evaluate, LateAndWithdrawnLoopsAreCountedBeside) {
  const GroundTruth truth{{{10, 0, 2}, {11, 1, 3}, {12, 2, 4}, {13, 3, 5}}, {}, {}};
  MatchList list = of_frames({loop(10, 2), rejected(11, 2, 0.5), loop(12, 9), loop(13, 4)}, 14);
  // 11 is found late, the wrong loop of 12 is withdrawn and found again, 9 is found late and wrong.
  list.changes = {loop(11, 2, 0.99), rejected(12, 9, 0.1), loop(12, 3, 0.99), loop(9, 0, 0.99)};
  const Evaluation evaluation = evaluate(list, truth);
  EXPECT_EQ(evaluation.decision.right, 2);
  EXPECT_EQ(evaluation.decision.wrong, 1);
  EXPECT_EQ(evaluation.missed, (std::vector<int>{11, 12}));
  EXPECT_EQ(evaluation.late.positives, 4);
  EXPECT_EQ(evaluation.late.right, 4);
  EXPECT_EQ(evaluation.late.wrong, 1);
  list.changes = {loop(11, -1, 0.99), rejected(13, 4, 0.2)};
  EXPECT_EQ(evaluate(list, truth).late.positives, 3) << "11 is in another recording";
  EXPECT_EQ(evaluate(list, truth).late.right, 1);
  list.changes = {};
  EXPECT_EQ(evaluate(list, truth).late.right, evaluation.decision.right);
}

TEST(Evaluate, NothingFoundIsPreciseAndHasNoRecall) {
  const Evaluation evaluation = evaluate({}, {{{5, 0, 0}}, {}, {}});
  EXPECT_EQ(evaluation.decision.recall(), 0.0);
  EXPECT_EQ(evaluation.decision.precision(), 1.0);
  EXPECT_EQ(evaluation.average_precision, 0.0);
  EXPECT_EQ(evaluation.score_at_full_precision, std::nullopt);
  EXPECT_TRUE(evaluation.curve.empty());
  EXPECT_EQ(evaluate({}, {}).decision.recall(), 0.0);
}

TEST(Evaluate, RevisitsAfterTheEndOfARunDoNotCount) {
  const GroundTruth truth{{{5, 0, 1}, {9, 0, 1}}, {}, {9}};
  EXPECT_EQ(evaluate(of_frames({loop(5, 0)}, 6), truth).decision.positives, 1);
  EXPECT_EQ(evaluate(of_frames({}, 5), truth).decision.positives, 0);
  EXPECT_EQ(evaluate(of_frames({}, 5), truth).pairs.positives, 0);
  EXPECT_EQ(evaluate(of_frames({}, 5), truth).decision.ignored, 0);
  EXPECT_EQ(evaluate(of_frames({}, 10), truth).decision.ignored, 1);
}

TEST(Evaluate, AListThatGoesBeyondTheTruthIsOfAnotherSequence) {
  const GroundTruth truth{.same_place = {{6, 0, 0}}, .every = 2, .frames = 8};
  EXPECT_EQ(evaluate({{loop(3, 0)}, {}}, truth).decision.right, 1);
  test::expect_error(ErrorKind::input, {"Query 4", "8 frames"}, [&] {
    evaluate({{loop(3, 0), loop(4, 0)}, {}}, truth);
  });
}

TEST(Evaluate, ToleranceIsCountedInFramesFromTheNearestTruePlace) {
  const GroundTruth truth{{{100, 20, 30}}, {}, {}};
  for (const int match : {10, 20, 30, 40}) {
    EXPECT_EQ(evaluate({{loop(100, match)}, {}}, truth, {10}).decision.right, 1) << match;
  }
  for (const int match : {9, 41}) {
    EXPECT_EQ(evaluate({{loop(100, match)}, {}}, truth, {10}).decision.wrong, 1) << match;
  }
}

TEST(Evaluate, APairCountsOnceHoweverOftenTruthListsIt) {
  const GroundTruth truth{{{10, 4, 6}, {10, 0, 5}, {10, 2, 3}, {11, 5, 5}, {10, 0, 5}}, {}, {}};
  const MatchList list{{loop(10, 0), loop(10, 5), loop(11, 5)}, {}};
  const PairCounts pairs = evaluate(list, truth).pairs;
  EXPECT_EQ(pairs.positives, 8);
  EXPECT_EQ(pairs.found, 3);
  EXPECT_DOUBLE_EQ(pairs.recall(), 3.0 / 8.0);
}

TEST(Evaluate, ToleratedPairsArePreciseButRecallNoTruePair) {
  const GroundTruth truth{{{10, 4, 4}}, {}, {}};
  const PairCounts pairs =
      evaluate({{loop(10, 3), loop(10, 4), loop(10, 5), loop(10, 7)}, {}}, truth, {2}).pairs;
  EXPECT_EQ(pairs.right, 3);
  EXPECT_EQ(pairs.wrong, 1);
  EXPECT_EQ(pairs.recall(), 1.0);
  EXPECT_EQ(pairs.precision(), 0.75);
}

TEST(Evaluate, NobodyIsRightOrWrongAboutUnknownFrames) {
  const GroundTruth truth{.same_place = {{10, 0, 0}, {11, 0, 0}}, .unknown = {4, 11}};
  const Evaluation evaluation = evaluate(of_frames({loop(10, 4), loop(11, 3)}, 12), truth);
  EXPECT_EQ(evaluation.decision.positives, 1);
  EXPECT_EQ(evaluation.decision.tolerated, 1);
  EXPECT_EQ(evaluation.decision.wrong, 0);
  EXPECT_EQ(evaluation.decision.ignored, 2);
  EXPECT_EQ(evaluate({{loop(10, 4), loop(11, 3)}, {}}, truth).decision.ignored, 1);
}

TEST(Evaluate, LoopsIntoOtherRecordingsAreNotJudged) {
  const GroundTruth truth{.same_place = {{10, 0, 0}, {11, 0, 0}}};
  MatchList list = of_frames({loop(11, 0)}, 12);
  list.elsewhere = {10};
  const Evaluation evaluation = evaluate(list, truth);
  EXPECT_EQ(evaluation.decision.positives, 1);
  EXPECT_EQ(evaluation.decision.right, 1);
  EXPECT_EQ(evaluation.decision.ignored, 1);
  EXPECT_TRUE(evaluation.missed.empty());
  EXPECT_EQ(evaluation.pairs.positives, 1);
}

TEST(Evaluate, FramesLeftOutAreLeftOutOfTheTruth) {
  // Of frames 0, 3, 6, ... of the sequence.
  const GroundTruth truth{
      .same_place = {{30, 0, 4}, {31, 0, 9}, {33, 4, 5}, {36, 7, 7}, {39, 8, 8}},
      .near_place = {{36, 12, 12}},
      .ignored = {27, 28},
      .unknown = {15, 16},
      .every = 3};
  const MatchList list = of_frames({loop(9, 8), loop(10, 1), loop(11, 1), loop(12, 4)}, 14);
  Evaluation evaluation = evaluate(list, truth);
  EXPECT_EQ(evaluation.decision.positives, 1) << "30: neither 4 to 5 nor 7 nor 8 was read";
  EXPECT_EQ(evaluation.decision.right, 1);
  EXPECT_EQ(evaluation.decision.tolerated, 1);
  EXPECT_EQ(evaluation.decision.wrong, 1);
  EXPECT_EQ(evaluation.decision.ignored, 2);
  EXPECT_EQ(evaluation.pairs.positives, 2) << "30 with 0 and 3";

  evaluation = evaluate(list, truth, {.tolerance_frames = 1});
  EXPECT_EQ(evaluation.decision.positives, 4) << "33 by 3 and 6, 36 by 6, 39 by 9";
  EXPECT_EQ(evaluation.decision.right, 2);
  EXPECT_EQ(evaluation.missed, (std::vector<int>{12, 13}));
  EXPECT_EQ(evaluation.pairs.positives, 2);
  EXPECT_EQ(evaluation.pairs.found, 1);
}

TEST(Evaluate, TheGreatestFrameNumbersDoNotOverflow) {
  constexpr int kLast = std::numeric_limits<int>::max();
  const GroundTruth truth{{{40, 0, kLast}, {41, 1, kLast}}, {}, {}};
  const Evaluation result = evaluate({{loop(40, kLast), loop(41, 0)}, {}}, truth, {2});
  EXPECT_EQ(result.pairs.positives, (std::int64_t{1} << 32) - 1);
  EXPECT_EQ(result.decision.right, 2);
}

TEST(Evaluate, TheBestMatchSpeaksForAQueryAndEveryPairForItself) {
  const GroundTruth truth{{{10, 0, 2}}, {}, {}};
  const MatchList list{{loop(10, 7, 1.0), loop(10, 1, 3.0), loop(10, 2, 2.0), loop(10, 2, 2.0)},
                       {}};
  const Evaluation evaluation = evaluate(list, truth);
  EXPECT_EQ(evaluation.decision.right, 1);
  EXPECT_EQ(evaluation.decision.wrong, 0);
  EXPECT_EQ(evaluation.pairs.right, 2);
  EXPECT_EQ(evaluation.pairs.wrong, 1);
  EXPECT_EQ(evaluation.pairs.positives, 3);
  EXPECT_DOUBLE_EQ(evaluation.pairs.recall(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(evaluation.pairs.precision(), 2.0 / 3.0);
}

TEST(Evaluate, EqualScoresAreAcceptedAllOrNone) {
  const GroundTruth truth{{{10, 0, 0}, {11, 0, 0}, {12, 0, 0}, {13, 0, 0}}, {}, {}};
  const MatchList list{{loop(10, 0, 9.0), loop(11, 0, 5.0), loop(12, 7, 5.0), loop(13, 0, 5.0)},
                       {}};
  const Evaluation evaluation = evaluate(list, truth);
  ASSERT_EQ(evaluation.curve.size(), 2U);
  EXPECT_EQ(evaluation.curve[0].right, 1);
  EXPECT_EQ(evaluation.curve[1].right, 3);
  EXPECT_EQ(evaluation.curve[1].wrong, 1);
  EXPECT_DOUBLE_EQ(evaluation.recall_at_full_precision, 0.25);
  EXPECT_EQ(evaluation.score_at_full_precision, 9.0);
  // 0.25 of the recall at precision 1, 0.5 of it at 3/4.
  EXPECT_DOUBLE_EQ(evaluation.average_precision, 0.25 + 0.5 * 0.75);
}

TEST(Evaluate, TheSweepTakesRejectedMatchesToo) {
  const GroundTruth truth{{{10, 0, 0}, {11, 0, 0}}, {}, {}};
  const Evaluation evaluation =
      evaluate({{loop(10, 0, 20.0), rejected(11, 0, 10.0), rejected(12, 3, 4.0)}, {}}, truth);
  EXPECT_DOUBLE_EQ(evaluation.decision.recall(), 0.5);
  EXPECT_DOUBLE_EQ(evaluation.recall_at_full_precision, 1.0);
  EXPECT_EQ(evaluation.score_at_full_precision, 10.0);
  EXPECT_DOUBLE_EQ(evaluation.curve.back().precision, 2.0 / 3.0);
}

/// The same numbers from their definitions, for every threshold anew.
void expect_as_defined(const MatchList& list, const GroundTruth& truth) {
  const Evaluation evaluation = evaluate(list, truth);
  const auto is_true = [&](const ReportedMatch& m) {
    return std::any_of(truth.same_place.begin(), truth.same_place.end(), [&](const PlaceRun& run) {
      return run.query == m.query && run.first <= m.match && m.match <= run.last;
    });
  };
  std::set<int> positives;
  for (const PlaceRun& run : truth.same_place) positives.insert(run.query);
  std::set<double, std::greater<>> thresholds;
  for (const ReportedMatch& m : list.matches) thresholds.insert(m.score);
  double best_recall = 0;
  double average_precision = 0;
  double recall_before = 0;
  std::size_t point = 0;
  for (const double threshold : thresholds) {
    int right = 0;
    int wrong = 0;
    for (const ReportedMatch& m : list.matches) {
      if (m.score < threshold) continue;
      ++(is_true(m) ? right : wrong);
    }
    const double recall = static_cast<double>(right) / static_cast<double>(positives.size());
    const double precision = static_cast<double>(right) / (right + wrong);
    average_precision += precision * (recall - recall_before);
    recall_before = recall;
    if (wrong == 0) best_recall = recall;
    ASSERT_LT(point, evaluation.curve.size());
    EXPECT_EQ(evaluation.curve[point].score, threshold);
    EXPECT_DOUBLE_EQ(evaluation.curve[point].recall, recall);
    EXPECT_DOUBLE_EQ(evaluation.curve[point].precision, precision);
    ++point;
  }
  EXPECT_EQ(point, evaluation.curve.size());
  EXPECT_DOUBLE_EQ(evaluation.recall_at_full_precision, best_recall);
  EXPECT_NEAR(evaluation.average_precision, average_precision, 1e-12);
}

TEST(Evaluate, IsAsDefinedOnRandomLists) {
  for (int stream = 0; stream < 50; ++stream) {
    test::Random random(stream);
    GroundTruth truth;
    MatchList list;
    for (int query = 50; query < 120; ++query) {
      if (random.uniform() < 0.5) {
        const int first = random.between(0, 40);
        truth.same_place.push_back({query, first, first + random.between(0, 9)});
      }
      if (random.uniform() < 0.8) {
        const int match = random.between(0, 49);
        // Few scores, so that many are equal.
        list.matches.push_back(loop(query, match, random.between(0, 12)));
      }
    }
    expect_as_defined(list, truth);
  }
}

TEST(WilsonInterval, AgreesWithPublishedValues) {
  // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
  const auto expect = [](int right, int loops, double low, double high) {
    const DecisionCounts counts{.right = right, .wrong = loops - right};
    EXPECT_NEAR(counts.precision_interval().low, low, 1e-4);
    EXPECT_NEAR(counts.precision_interval().high, high, 1e-4);
  };
  expect(81, 263, 0.2553, 0.3662);
  expect(15, 148, 0.0624, 0.1605);
  expect(0, 20, 0.0000, 0.1611);
  expect(1, 29, 0.0061, 0.1718);
  expect(0, 0, 0.0, 1.0);
}

TEST(EvaluationJson, SaysWhatTheEvaluationDoes) {
  const GroundTruth truth{{{10, 0, 2}, {11, 0, 2}}, {}, {}};
  const Evaluation evaluation = evaluate({{loop(10, 1, 9.5), loop(12, 3, 8.0)}, {}}, truth);
  const Json json = Json::parse(to_json(evaluation, true));
  EXPECT_EQ(json["protocol"], nullptr);
  EXPECT_EQ(json["tolerance_frames"], 0);
  EXPECT_EQ(json["positives"], 2);
  EXPECT_EQ(json["right"], 1);
  EXPECT_EQ(json["wrong"], 1);
  EXPECT_EQ(json["recall"], 0.5);
  EXPECT_EQ(json["precision"], 0.5);
  EXPECT_EQ(json["recall_at_full_precision"], 0.5);
  EXPECT_EQ(json["score_at_full_precision"], 9.5);
  EXPECT_EQ(json["pairs"]["positives"], 6);
  EXPECT_EQ(json["curve"].size(), 2U);
  EXPECT_EQ(json["wrong_loops"], Json::parse(R"([{"query": 12, "match": 3, "score": 8.0}])"));
  EXPECT_EQ(json["missed"], Json::parse("[11]"));
  const Json brief = Json::parse(to_json(evaluation, false));
  EXPECT_FALSE(brief.contains("curve"));
  EXPECT_EQ(brief["recall"], json["recall"]);
}

TEST(Protocol, IsFoundByNameOrItsNamesAreListed) {
  EXPECT_EQ(find_protocol("ibow-lcd").tolerance_frames, 40);
  EXPECT_EQ(find_protocol("kitti").truth.poses.min_gap_frames, 150);
  test::expect_error(ErrorKind::option, {"'orb'", "kitti", "ibow-lcd", "tsintotas", "fab-map"},
                     [] { (void)find_protocol("orb"); });
}

TEST(PublishedResults, IbowLcdOnCityCentre) {
  LOOPBIT_NEEDS_DATA("truth");
  const std::string folder = (*test::data_dir() / "truth").string();
  const Protocol& protocol = find_protocol("ibow-lcd");
  const GroundTruth truth = read_truth(folder + "/mat/city_centre_htmap.mat", protocol.truth);
  const MatchList list = read_match_list(folder + "/published/ibow_lcd_city_centre.csv");
  const Evaluation evaluation = evaluate(list, truth, protocol.evaluation());
  EXPECT_EQ(evaluation.decision.positives, 561);
  EXPECT_EQ(evaluation.decision.right, 495);
  EXPECT_EQ(evaluation.decision.wrong, 0);
  EXPECT_NEAR(evaluation.decision.recall(), 0.8824, 5e-5);
  EXPECT_NEAR(evaluation.recall_at_full_precision, 0.8824, 5e-5);
  // By the cell itself one match is off; numbers of different protocols must not be mixed.
  EXPECT_EQ(evaluate(list, truth).decision.right, 494);
}

TEST(PublishedResults, OtherMatricesSayOtherThings) {
  LOOPBIT_NEEDS_DATA("truth");
  const std::string folder = (*test::data_dir() / "truth").string();
  const MatchList list = read_match_list(folder + "/published/ibow_lcd_city_centre.csv");
  const GroundTruth truth = read_truth(folder + "/mat/groundTruthCityCentre.mat");
  const Evaluation exact = evaluate(list, truth);
  EXPECT_EQ(exact.decision.positives, 547);
  EXPECT_EQ(exact.decision.right, 481);
  EXPECT_EQ(evaluate(list, truth, {40}).decision.right, 489);
}

}  // namespace
}  // namespace loopbit
