// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/report.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include <nlohmann/json.hpp>

#include "evidence_writer.hpp"
#include "report_json.hpp"
#include "run_folder.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::json;

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class ReportTest : public test::ScratchTest {
 protected:
  /// A run of four frames: nothing, nothing, a right loop, a missed revisit.
  [[nodiscard]] ReportRun finished_run(const std::string& name) const {
    const GroundTruth truth{{{2, 0, 0}, {3, 0, 1}}, {}, {}};
    RunFolder folder(path(name), false);
    folder.add({.frame = 0});
    folder.add({.frame = 1, .status = Status::low_score, .match = 0, .score = 4.0});
    folder.add({.frame = 2,
                .status = Status::loop,
                .match = 0,
                .score = 30.0,
                .similarity = 0.5,
                .matches = 40,
                .inliers = 31,
                .times = {1.0, 0.25, 8.0, 9.0},
                .name = "2.png"});
    folder.add({.frame = 3, .status = Status::low_score, .match = 0, .score = 11.0});
    EvidenceWriter evidence(folder.evidence_path());
    test::Random random;
    for (int frame = 0; frame < 4; ++frame) {
      evidence.add(frame, test::view(frame),
                   {test::random_content(random, 0.2),
                    cv::Mat1f(64, 64, 1.0F),
                    {{{0.25F, 0.5F}, {0.75F, 1.0F}}}});
    }
    evidence.finish();
    folder.write_truth(truth);
    folder.write_positions(
        {cv::Vec3d(0, 5, 0), cv::Vec3d(0, 5, 9), std::nullopt, cv::Vec3d(1, 5, 0)});
    RunRecord record;
    record.input = "<images>";
    record.truth = "told by <a test>";
    record.score = evaluate(match_list(folder.detections()), truth);
    folder.write_record(record);
    ReportRun run;
    run.name = name;
    run.run = read_run(path(name));
    run.list = match_list(run.run->detections);
    run.truth = run.run->truth;
    run.positions_m = run.run->positions_m;
    return run;
  }

  /// Every third frame from 102 on is a loop with the frame 100 before, which is right except at
  /// 270. Scores rise.
  [[nodiscard]] ReportRun run_of_loops(const std::string& name, int frames) const {
    RunFolder folder(path(name), false);
    EvidenceWriter evidence(folder.evidence_path());
    GroundTruth truth;
    test::Random random;
    const cv::Mat image = test::view(0);
    for (int frame = 0; frame < frames; ++frame) {
      Detection detection{.frame = frame};
      if (frame >= 102 && frame % 3 == 0) {
        detection.status = Status::loop;
        detection.match = frame - 100;
        detection.score = frame;
        if (frame != 270) truth.same_place.push_back({frame, frame - 100, frame - 100});
      }
      folder.add(detection);
      evidence.add(frame, image, {test::random_content(random, 0.2), cv::Mat1f(64, 64, 1.0F), {}});
    }
    evidence.finish();
    folder.write_truth(truth);
    folder.write_record({});
    ReportRun run;
    run.run = read_run(path(name));
    run.list = match_list(run.run->detections);
    run.truth = run.run->truth;
    return run;
  }
};

TEST_F(ReportTest, SaysHowTheTrajectoryWasCorrected) {
  ReportRun run = finished_run("run");
  const auto correction = [&] { return Json::parse(report_json({run}))["runs"][0]["correction"]; };
  EXPECT_TRUE(correction().is_null());
  run.run->trajectory = {{0, {0, 1, 0}, {0, 1, 0}}, {2, {1, 1, 9}, {2, 1, 8}}};
  run.run->judged_loops = {{2, 0, LoopVerdict::kept}, {3, 1, LoopVerdict::outlier}};
  EXPECT_EQ(correction(), Json::parse(R"({
    "before": {"x_m": [0.0, null, 1.0, null], "y_m": [0.0, null, 9.0, null], "axes": ["x", "z"]},
    "after": {"x_m": [0.0, null, 2.0, null], "y_m": [0.0, null, 8.0, null], "axes": ["x", "z"]},
    "loops": [2, 0, 1, 3, 1, 0]})"));
}

TEST_F(ReportTest, SaysWhatTheRunFolderDoes) {
  const ReportRun run = finished_run("run");
  const Json json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["frames"], 4);
  EXPECT_EQ(json["verdict"], Json::parse(R"(["none", "none", "right", "missed"])"));
  EXPECT_EQ(json["match"], Json::parse("[-1, 0, 0, 0]"));
  EXPECT_EQ(json["score"], Json::parse("[0.0, 4.0, 30.0, 11.0]"));
  EXPECT_EQ(json["status_names"][json["status"][2].get<std::size_t>()], "loop");
  EXPECT_EQ(json["inliers"][2], 31);
  EXPECT_EQ(json["names"], Json::parse(R"(["", "", "2.png", ""])"));
  EXPECT_EQ(json["revisits"], Json::parse(R"([{"query": [2, 2], "match": [0, 0], "loops": 1}])"));
  EXPECT_EQ(json["times_ms"]["features"][2], 8.0);
  EXPECT_EQ(json["threshold"], LoopDetectorOptions{}.decision.min_score);
  EXPECT_EQ(json["evaluation"]["recall"], 0.5);
  EXPECT_EQ(json["evaluation"]["recall"], json["record"]["score"]["recall"]);
  EXPECT_EQ(json["record"]["input"]["path"], "<images>");
  EXPECT_EQ(json["truth"]["same_place"], Json::parse("[2, 0, 0, 3, 0, 1]"));
}

TEST_F(ReportTest, TheMapIsThePlaneInWhichTheCameraMovedMost) {
  const Json json = Json::parse(report_json({finished_run("run")}))["runs"][0]["positions"];
  EXPECT_EQ(json["x_m"], Json::parse("[0.0, 0.0, null, 1.0]"));
  EXPECT_EQ(json["y_m"], Json::parse("[0.0, 9.0, null, 0.0]"));
  EXPECT_EQ(json["axes"], Json::parse(R"(["x", "z"])"));
}

TEST_F(ReportTest, LoopsHaveTheirRelativePoses) {
  ReportRun run = finished_run("run");
  EXPECT_TRUE(Json::parse(report_json({run}))["runs"][0]["poses"].is_null());
  // The query stands 2 m right of the match and looks ahead, or 0.1 rad to the right.
  LoopPose aside{.query = 2, .match = 0, .inliers = 20};
  aside.pose.status = PoseStatus::measured;
  aside.pose.known = PoseKnown::metric;
  aside.pose.T_match_query(0, 3) = 2;
  aside.pose.covariance = cv::Matx66d::diag({0.01, 0.0, 0.04, 1e-6, 4e-6, 1e-6});
  LoopPose turned{.query = 3, .match = 0, .inliers = 20};
  turned.pose.status = PoseStatus::pure_rotation;
  turned.pose.known = PoseKnown::rotation;
  turned.pose.T_match_query(0, 2) = std::sin(0.1);
  turned.pose.T_match_query(0, 0) = turned.pose.T_match_query(2, 2) = std::cos(0.1);
  turned.pose.T_match_query(2, 0) = -std::sin(0.1);
  run.run->poses = {{.query = 1, .match = 0}, aside, turned};
  run.run->camera =
      CameraModel{.size_px = {320, 240}, .fx = 200, .fy = 200, .cx = 159.5, .cy = 119.5};
  const Json poses = Json::parse(report_json({run}))["runs"][0]["poses"];
  EXPECT_EQ(poses["1"], Json::parse(R"({"match": 0, "status": "few_matches", "known": "nothing",
                                        "scale": "not_asked", "inliers": 0, "points": 0})"));
  EXPECT_EQ(poses["2"]["translation"], Json::parse("[2.0, 0.0, 0.0]"));
  EXPECT_EQ(poses["2"]["position_from_above"], Json::parse("[0.01, 0.0, 0.04]"));
  EXPECT_NEAR(poses["2"]["translation_sigma"].get<double>(), 0.2, 1e-9);
  EXPECT_NEAR(poses["2"]["rotation_sigma_rad"].get<double>(), 0.002, 1e-9);
  EXPECT_NEAR(poses["3"]["rotation_rad"].get<double>(), 0.1, 1e-9);
  EXPECT_NEAR(poses["3"]["heading"][0].get<double>(), std::sin(0.1), 1e-9);
  EXPECT_FALSE(poses["3"].contains("translation"));
  // A camera that moved along x sees a point on its row, at its own column or nearer to the query.
  const Json& lines = poses["2"]["epipolar"];
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0]["query"], Json::parse("[0.25, 0.5]"));
  ASSERT_EQ(lines[0]["match"].size(), 1U);
  const auto points = lines[0]["match"][0].get<std::vector<double>>();
  ASSERT_GT(points.size(), 10U);
  EXPECT_NEAR(points[0], 0.25, 1e-4);
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    EXPECT_NEAR(points[i + 1], 0.5, 1e-4);
    EXPECT_TRUE(i == 0 || points[i] > points[i - 2]);
  }
}

TEST_F(ReportTest, PicturesKeepToTheBudget) {
  const ReportRun run = finished_run("run");
  const auto pictures = [&](double mb) {
    return Json::parse(report_json({run}, {.max_pictures_mb = mb}))["runs"][0]["pictures"];
  };
  const Json all = pictures(1.0);
  EXPECT_EQ(all.size(), 4U);
  EXPECT_TRUE(pictures(0.0).empty());
  const std::size_t one = all["2"].dump().size();
  const Json some = pictures(2.5e-6 * static_cast<double>(one));
  EXPECT_GE(some.size(), 1U);
  EXPECT_LT(some.size(), 4U);
  EXPECT_LE(some.dump().size(), 5 * one / 2 + 100);
}

TEST_F(ReportTest, TheFirstPairWrongAndWeakLoopsHavePicturesBeforeOthers) {
  // 300 frames: a loop every third frame, stronger with the number, with one that is wrong.
  ReportRun run = run_of_loops("run", 300);
  const auto report = [&](double mb) {
    return Json::parse(report_json({run}, {.max_pictures_mb = mb}))["runs"][0];
  };
  const double one = static_cast<double>(report(100.0)["pictures"]["299"].dump().size());
  const Json json = report(1e-6 * 100 * one);
  const auto has_pair = [&](std::size_t frame) {
    const Json& pictures = json["pictures"];
    return pictures.contains(std::to_string(frame)) &&
           pictures.contains(std::to_string(json["match"][frame].get<int>()));
  };
  EXPECT_EQ(json["first_frame"], 270);
  EXPECT_EQ(json["verdict"][270], "wrong");
  EXPECT_TRUE(has_pair(270));
  for (std::size_t frame = 102; frame < 180; frame += 3) EXPECT_TRUE(has_pair(frame)) << frame;
  run.truth.reset();
  EXPECT_EQ(report(0)["first_frame"], 297);
}

TEST_F(ReportTest, MoreFramesThanAPageShowsAreRefused) {
  ReportRun run;
  run.name = "other";
  for (const int query : {2'000'000, std::numeric_limits<int>::max()}) {
    run.list.matches = {{query, 5, 1.0, true}};
    test::expect_error(ErrorKind::input, {"'other'", "2000000", "loopbit eval"},
                       [&] { (void)report_json({run}); });
  }
}

TEST_F(ReportTest, AnyDetectorsMatchesCanBeShown) {
  ReportRun run;
  run.name = "other";
  run.list = {{{.query = 5, .match = 1, .score = 3.0}, {.query = 5, .match = 2, .score = 4.0}}, {}};
  const Json json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["frames"], 6);
  EXPECT_EQ(json["frames_known"], false);
  EXPECT_EQ(json["match"][5], 2);
  EXPECT_EQ(json["score"], Json::parse("[null, null, null, null, null, 4.0]"));
  EXPECT_EQ(json["verdict"][5], "loop");
  EXPECT_EQ(json["verdict"][0], "none");
  for (const char* name : {"record", "threshold", "earlier_match", "similarity", "times_ms",
                           "truth", "evaluation", "positions", "similarity_matrix"}) {
    EXPECT_TRUE(json[name].is_null()) << name;
  }
}

TEST_F(ReportTest, ADetectorThatListsNoFramesHasThoseOfTheOtherRuns) {
  ReportRun other;
  other.list = {{{.query = 2, .match = 1}}};
  Json runs = Json::parse(report_json({finished_run("run"), other}))["runs"];
  EXPECT_EQ(runs[1]["frames"], 4);
  EXPECT_EQ(runs[1]["frames_known"], true);
  other.positions_m.resize(9);
  runs = Json::parse(report_json({other}))["runs"];
  EXPECT_EQ(runs[0]["frames"], 9);
  EXPECT_EQ(runs[0]["frames_known"], true);
  other.positions_m.clear();
  other.truth = GroundTruth{.same_place = {{6, 0, 1}}, .near_place = {}, .ignored = {}};
  runs = Json::parse(report_json({other}))["runs"];
  EXPECT_EQ(runs[0]["frames"], 7);
  EXPECT_EQ(runs[0]["frames_known"], false);
  EXPECT_EQ(runs[0]["verdict"][6], "missed");
}

TEST_F(ReportTest, ALoopIntoAnEarlierSessionIsALoopThatTruthDoesNotJudge) {
  FinishedRun finished;
  finished.detections = {{.frame = 0},
                         {.frame = 1,
                          .status = Status::loop,
                          .earlier_match = SessionFrame{.session = 1, .frame = 17},
                          .score = 40.0,
                          .similarity = 0.5,
                          .inliers = 30},
                         {.frame = 2,
                          .status = Status::low_score,
                          .earlier_match = SessionFrame{.session = 2, .frame = 3},
                          .score = 4.0},
                         {.frame = 3, .status = Status::loop, .match = 0, .score = 20.0}};
  ReportRun run;
  run.list = match_list(finished.detections);
  run.run = finished;
  Json json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["earlier_match"], Json::parse("[null, [1, 17], [2, 3], null]"));
  EXPECT_EQ(json["match"], Json::parse("[-1, -1, -1, 0]"));
  EXPECT_EQ(json["score"], Json::parse("[0.0, 40.0, 4.0, 20.0]"));
  EXPECT_EQ(json["inliers"][1], 30);
  EXPECT_EQ(json["verdict"], Json::parse(R"(["none", "loop", "none", "loop"])"));
  run.truth = GroundTruth{.same_place = {{1, 0, 0}, {3, 0, 0}}, .near_place = {}, .ignored = {}};
  json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["verdict"], Json::parse(R"(["none", "elsewhere", "none", "right"])"));
  EXPECT_EQ(json["evaluation"]["positives"], 1);
  run.run.reset();
  json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["verdict"][1], "elsewhere");
  EXPECT_EQ(json["status_names"][json["status"][1].get<std::size_t>()], "loop");
}

TEST_F(ReportTest, TruthHasTheNumbersOfTheFramesRead) {
  ReportRun run;
  run.list = {{{.query = 4, .match = 1}}, std::vector<std::optional<double>>(5)};
  run.truth = GroundTruth{.same_place = {{8, 2, 3}, {7, 0, 1}}};
  run.truth->every = 2;
  const Json json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["truth"]["same_place"], Json::parse("[4, 1, 1]"));
  EXPECT_EQ(json["verdict"], Json::parse(R"(["none", "none", "none", "none", "right"])"));
}

TEST_F(ReportTest, WhatTruthIsStandsInTheRecordOfTheRunThatItWasGivenTo) {
  ReportRun run = finished_run("run");
  ReportRun other;
  other.list = run.list;
  other.truth = run.truth;
  Json runs = Json::parse(report_json({run, other}))["runs"];
  EXPECT_EQ(runs[0]["truth"]["source"], "told by <a test>");
  EXPECT_EQ(runs[1]["truth"]["source"], "told by <a test>");
  run.truth->same_place.pop_back();
  runs = Json::parse(report_json({run, other}))["runs"];
  EXPECT_TRUE(runs[0]["truth"]["source"].is_null());
}

TEST_F(ReportTest, TheMatrixOfManyFramesHasEveryMatch) {
  constexpr int kFrames = 2049;
  const auto matrix_of = [&](const std::string& name, bool with_match) {
    test::Random random;
    const BinaryContent place = test::random_content(random, 0.2);
    RunFolder folder(path(name), false);
    EvidenceWriter evidence(folder.evidence_path());
    for (int frame = 0; frame < kFrames; ++frame) {
      Detection detection{.frame = frame};
      if (with_match && frame == 2001) detection.match = 1001;
      folder.add(detection);
      const bool is_place = frame == 2001 || frame == 1001;
      evidence.add(frame, cv::Mat1b(32, 32, std::uint8_t{0}),
                   {is_place ? place : BinaryContent{}, cv::Mat1f(64, 64, 1.0F), {}});
    }
    evidence.finish();
    ReportRun run;
    run.run = read_run(path(name));
    run.list = match_list(run.run->detections);
    return Json::parse(report_json({run}, {.max_pictures_mb = 0}))["runs"][0]["similarity_matrix"];
  };
  const Json without = matrix_of("without", false);
  const Json with = matrix_of("with", true);
  EXPECT_EQ(with["compared_every"], 2);
  EXPECT_EQ(with["frames_per_cell"], 4);
  EXPECT_NE(with["png"], without["png"]);
}

TEST_F(ReportTest, ThePageHoldsTheDataAndNothingEndsItEarly) {
  write_report(path("page.html"), {finished_run("</script>")});
  const std::string page = text_of(path("page.html"));
  EXPECT_EQ(page.find("@REPORT_DATA@"), std::string::npos);
  EXPECT_EQ(page.find("</script>\""), std::string::npos);
  const std::string begin = R"(id="report-data">)";
  const auto first = page.find(begin) + begin.size();
  const auto last = page.find("</script>", first);
  const Json json = Json::parse(page.substr(first, last - first));
  EXPECT_EQ(json["runs"][0]["name"], "</script>");
  EXPECT_EQ(json["runs"][0]["record"]["input"]["path"], "<images>");
}

TEST_F(ReportTest, APageThatCannotBeWrittenIsNamed) {
  test::expect_error(ErrorKind::output, {path("no/page.html")},
                     [&] { write_report(path("no/page.html"), {finished_run("run")}); });
}

TEST_F(ReportTest, ARunThatWasCutOffIsShown) {
  (void)finished_run("run");
  std::filesystem::remove(path("run/run.json"));
  const std::string rows = text_of(path("run/loops.csv"));
  (void)write("run/loops.csv", rows.substr(0, rows.size() - 5));
  ReportRun run;
  run.run = read_run(path("run"));
  run.list = match_list(run.run->detections);
  const Json json = Json::parse(report_json({run}))["runs"][0];
  EXPECT_EQ(json["frames"], 3);
  EXPECT_TRUE(json["record"].is_null());
}

}  // namespace
}  // namespace loopbit
