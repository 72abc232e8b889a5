// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/finished_run.hpp"
#include "loopbit/runner.hpp"

#include "evidence_writer.hpp"
#include "run_files.hpp"
#include "run_folder.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

RunRecord stopped_by(const std::string& reason) {
  RunRecord record;
  record.stopped_by = reason;
  return record;
}

class RunFolderTest : public test::ScratchTest {};

TEST_F(RunFolderTest, RowsAreOnDiskAtOnce) {
  RunFolder folder(path("run"), false);
  folder.add(
      {.frame = 0, .timestamp_s = 12.5, .status = Status::no_earlier_place, .name = "0.png"});
  folder.add({.frame = 1,
              .status = Status::loop,
              .match = 0,
              .score = 20.5,
              .terms = ScoreTerms{2.5, 1, 8.0625, -0.5, -9.25},
              .similarity = 0.25,
              .matches = 30,
              .inliers = 21,
              .times = {1.0, 0.5, 12.25, 3.0},
              .name = "left, \"new\"\n/1.png"});
  EXPECT_EQ(test::lines_of(path("run/loops.csv")),
            (std::vector<std::string>{
                kLoopsHeader,
                "0,12.500000,no_earlier_place,,0,0.000000,0,0,,,,,,0.png,,0.000,0.000,0.000,0.000",
                R"(1,,loop,0,20.5,0.250000,30,21,2.500,1.000,8.062,-0.500,-9.250,)"
                R"(left\x2c \x22new\x22\x0a/1.png,0.png,)"
                "1.000,0.500,12.250,3.000"}));
  const auto read = read_detections(path("run/loops.csv"));
  EXPECT_EQ(read[0].name, "0.png");
  EXPECT_FALSE(read[0].terms);
  ASSERT_TRUE(read[1].terms);
  EXPECT_EQ(read[1].terms->rivals, -0.5);
  EXPECT_EQ(read[1].terms->prior, -9.25);
  EXPECT_EQ(read_match_list(path("run/loops.csv")).matches.size(), 1U);
}

TEST_F(RunFolderTest, NeverReplacesARunUnasked) {
  RunFolder(path("run"), false).add({.frame = 0, .status = Status::unreadable});
  const auto before = test::lines_of(path("run/loops.csv"));
  test::expect_error(ErrorKind::output, {path("run"), "--overwrite"},
                     [&] { const RunFolder again(path("run"), false); });
  EXPECT_EQ(test::lines_of(path("run/loops.csv")), before);
  const RunFolder replaced(path("run"), true);
  EXPECT_EQ(test::lines_of(path("run/loops.csv")), std::vector<std::string>{kLoopsHeader});
}

TEST_F(RunFolderTest, OverwritingKeepsOtherFiles) {
  RunFolder(path("run"), false).write_record({});
  (void)write("run/notes.txt", "mine");
  const RunFolder replaced(path("run"), true);
  EXPECT_TRUE(fs::exists(path("run/notes.txt")));
  EXPECT_FALSE(fs::exists(path("run/run.json")));
}

TEST_F(RunFolderTest, ReplacesNeitherADataSetNorWhatIsRead) {
  const std::string truth = write("truth.csv", "5,1,2\n");
  test::expect_error(ErrorKind::output, {path(""), "truth.csv", "no earlier run"},
                     [&] { const RunFolder over(path(""), true); });
  EXPECT_EQ(test::lines_of(truth), std::vector<std::string>{"5,1,2"});
  { RunFolder(path("run"), false).write_truth({}); }
  const std::string own = path("run/truth.csv");
  test::expect_error(ErrorKind::output, {own, "is read"}, [&] {
    const RunFolder over(path("run"), true, {"", own});
  });
  EXPECT_TRUE(fs::exists(own));
  EXPECT_TRUE(fs::exists(path("run/loops.csv")));
}

TEST_F(RunFolderTest, AFolderThatCannotBeMadeIsNamed) {
  const std::string file = write("file", "");
  test::expect_error(ErrorKind::output, {file}, [&] { RunFolder(file + "/run", false); });
}

std::vector<Detection> four_detections() {
  return {{.frame = 0, .timestamp_s = 0.5},
          {.frame = 1,
           .timestamp_s = 1.25,
           .status = Status::loop,
           .match = 0,
           .score = 20.5,
           .similarity = 0.25,
           .matches = 30,
           .inliers = 21,
           .times = {1.0, 0.5, 12.25, 3.0}},
          {.frame = 2, .status = Status::unreadable},
          {.frame = 3, .status = Status::no_geometry, .match = 1, .score = 0.0, .matches = 9}};
}

/// A record of which no value is the default.
RunRecord full_record() {
  RunRecord record{.input = "images",
                   .description = "a folder",
                   .options = {},
                   .sampling = {.every = 4, .limit = 9},
                   .threads = 3,
                   .map_session = 5,
                   .map_path = "town.db",
                   .map_reconnections = 6,
                   .map_queue = "run/queue.db",
                   .map_queued_frames = 7,
                   .map_unverified = 8,
                   .map_not_asked = {"postgresql://b.example/town"},
                   .stopped_by = "interrupt",
                   .wall_s = 1.5,
                   .arguments = {"run", "images"},
                   .early_end = "The video is cut off.",
                   .correction = Correction{.keyframes = 21,
                                            .by_verdict = {0, 4, 3, 2, 1},
                                            .unjudged = 6,
                                            .odometry_error_m = 7.5},
                   .truth = "truth.csv",
                   .truth_every = 2,
                   .machine = {"a processor", 7, "avx2", "Linux"},
                   .results = RunResults{.frames = 4,
                                         .by_status = {1, 2},
                                         .content_ms = {1, 2, 3, 4},
                                         .retrieval_ms = {5, 6, 7, 8},
                                         .features_ms = {9, 10, 11, 12},
                                         .verification_ms = {13, 14, 15, 16},
                                         .total_ms = {17, 18, 19, 20},
                                         .frames_per_s = 2.5,
                                         .peak_memory_mib = 99}};
  record.options.surf.max_keypoints = 77;
  record.options.surf.upright = false;
  const GroundTruth truth{.same_place = {{1, 0, 0}, {3, 0, 0}}};
  record.score = evaluate(match_list(four_detections()), truth, {2, "of old"});
  return record;
}

TEST(RunRecord, WhatWasWrittenIsRead) {
  for (const RunRecord& record : {RunRecord{}, stopped_by(kRunning), full_record()}) {
    const std::string json = to_json(record);
    EXPECT_EQ(to_json(run_record_from_json(json, "run.json")), json);
  }
  const RunRecord read = run_record_from_json(to_json(full_record()), "run.json");
  EXPECT_FALSE(read.options.surf.upright);
  EXPECT_EQ(read.score->options.protocol, "of old");
  EXPECT_EQ(read.results->frames, 4);
  EXPECT_EQ(read.correction->kept(), 4);
  EXPECT_EQ(read.correction->rejected(), 6);
  EXPECT_EQ(read.correction->odometry_error_m, 7.5);
  EXPECT_FALSE(read.correction->corrected_error_m);
}

TEST(RunRecord, ReadsAnotherVersion) {
  const RunRecord read = run_record_from_json(
      R"({"loopbit": "0.0.1", "options": {"of_old": {"a": 1}}, "input": {"every": 3}, "x": []})",
      "run.json");
  EXPECT_EQ(read.version, "0.0.1");
  EXPECT_EQ(read.sampling.every, 3);
  EXPECT_FALSE(read.score || read.results);
}

TEST(RunRecord, ADamagedFileIsRefusedWithKeyAndValue) {
  const auto refuses = [](const std::string& json, std::initializer_list<std::string_view> words) {
    SCOPED_TRACE(json);
    test::expect_error(ErrorKind::input, words,
                       [&] { (void)run_record_from_json(json, "old/run.json"); });
  };
  refuses("{\"score\"", {"'old/run.json'", "is not a JSON object", "run again"});
  refuses("[1]", {"is not a JSON object"});
  refuses("{}", {"has no 'loopbit'"});
  refuses(R"({"loopbit": "1"})", {"has no 'options'"});
  const auto with = [](const std::string& rest) {
    return R"({"loopbit": "1", "options": {}, )" + rest + "}";
  };
  refuses(with(R"("threads": "x")"), {"'old/run.json' has \"x\" for 'threads'", "delete"});
  refuses(with(R"("threads": 1.5)"), {"has 1.5 for 'threads'"});
  refuses(with(R"("threads": 99999999999)"), {"has 99999999999 for 'threads'"});
  refuses(with(R"("input": {"every": 0})"), {"has 0 for 'input.every'"});
  refuses(with(R"("input": [2])"), {"has an array for 'input'"});
  refuses(with(R"("score": {"tolerance_frames": -1})"), {"has -1 for 'score.tolerance_frames'"});
  refuses(with(R"("arguments": [1])"), {"has an array for 'arguments'"});
  refuses(R"({"loopbit": "1", "options": {"surf": {"upright": 1}}})",
          {"1 for 'options.surf.upright'"});
  refuses(with(R"("truth": )" + std::string(100'000, '[') + std::string(100'000, ']')),
          {"has an array for 'truth'"});
}

TEST_F(RunFolderTest, WhatWasWrittenIsRead) {
  const GroundTruth truth{{{1, 0, 0}, {3, 0, 1}}, {{3, 0, 2}}, {2}, {0}};
  const std::vector<std::optional<cv::Vec3d>> positions{cv::Vec3d(0.5, -2.0, 1e3), std::nullopt,
                                                        cv::Vec3d(1, 2, 3), cv::Vec3d(0, 0, 0)};
  RunFolder folder(path("run"), false);
  for (const Detection& detection : four_detections()) folder.add(detection);
  folder.write_truth(truth);
  folder.write_positions(positions);
  folder.write_record({});

  const FinishedRun run = read_run(path("run"));
  ASSERT_EQ(run.detections.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const Detection expected = four_detections()[i];
    const Detection& read = run.detections[i];
    EXPECT_EQ(read.frame, expected.frame);
    EXPECT_EQ(read.timestamp_s, expected.timestamp_s);
    EXPECT_EQ(read.status, expected.status);
    EXPECT_EQ(read.match, expected.match);
    EXPECT_EQ(read.score, expected.score);
    EXPECT_EQ(read.similarity, expected.similarity);
    EXPECT_EQ(read.matches, expected.matches);
    EXPECT_EQ(read.inliers, expected.inliers);
    EXPECT_EQ(total_ms(read.times), total_ms(expected.times));
  }
  ASSERT_TRUE(run.truth.has_value());
  EXPECT_EQ(run.truth->same_place, truth.same_place);
  EXPECT_EQ(run.truth->near_place, truth.near_place);
  EXPECT_EQ(run.truth->ignored, truth.ignored);
  EXPECT_EQ(run.truth->unknown, truth.unknown);
  EXPECT_EQ(run.truth->every, 1);
  EXPECT_EQ(run.positions_m, positions);
  EXPECT_NE(run.record_json.find("\"stopped_by\""), std::string::npos);
  EXPECT_EQ(run.evidence_path, "");
  const MatchList list = match_list(run.detections);
  EXPECT_EQ(list.times_s.size(), 4U);
  EXPECT_EQ(list.matches, (std::vector<ReportedMatch>{{1, 0, 20.5, true}, {3, 1, 0.0, false}}));
}

TEST_F(RunFolderTest, ACutOffListGivesItsWholeRowsAndNeverMore) {
  RunFolder folder(path("run"), false);
  for (const Detection& detection : four_detections()) folder.add(detection);
  std::ifstream file(path("run/loops.csv"), std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  for (std::size_t bytes = text.find('\n') + 1; bytes <= text.size(); ++bytes) {
    const std::string cut = write("cut.csv", text.substr(0, bytes));
    const auto rows = std::count(text.begin(), text.begin() + static_cast<long>(bytes), '\n') - 1;
    EXPECT_EQ(read_detections(cut).size(), static_cast<std::size_t>(rows)) << bytes;
  }
  test::expect_error(ErrorKind::input, {"begin"},
                     [&] { (void)read_detections(write("c", "a\n")); });
}

TEST_F(RunFolderTest, AChangedRowIsNamed) {
  const std::string header = std::string(kLoopsHeader) + "\n";
  const auto expect_refused = [&](const std::string& row, std::string_view part) {
    const std::string file = write("loops.csv", header + row + "\n");
    test::expect_error(ErrorKind::input, {file, "line 2", part},
                       [&] { (void)read_detections(file); });
  };
  expect_refused("0,,loop,0,1,0,0,0,,,,,,,,0,0,0", "18 columns");
  expect_refused("0,,maybe,0,1,0,0,0,,,,,,,,0,0,0,0", "'maybe'");
  expect_refused("0,,loop,x,1,0,0,0,,,,,,,,0,0,0,0", "'x'");
  expect_refused("1,,loop,0,1,0,0,0,,,,,,,,0,0,0,0", "'1'");
  expect_refused("0,,loop,-7,1,0,0,0,,,,,,,,0,0,0,0", "'-7'");
  expect_refused("0,,loop,0,nan,0,0,0,,,,,,,,0,0,0,0", "'nan'");
  expect_refused("0,,loop,0,1,inf,0,0,,,,,,,,0,0,0,0", "'inf'");
  expect_refused("0,,loop,0,1,0,0,0,1,,2,3,4,,,0,0,0,0", "''");
  const std::string carried =
      write("loops.csv", std::string(kLoopsHeader) + "\r\n0,,loop,0,1,0,0,0,,,,,,,,0,0,0,0\r\n");
  EXPECT_EQ(read_detections(carried).size(), 1U);
  test::expect_error(ErrorKind::input, {path("none"), "loops.csv"},
                     [&] { (void)read_run(path("none")); });
}

TEST_F(RunFolderTest, LateLoopsAreReadWhereTheyWereReported) {
  {
    RunFolder folder(path("run"), false);
    folder.add({.frame = 0, .name = "a,b.png"});
    folder.add({.frame = 1, .status = Status::loop, .match = 0, .score = 0.99});
    folder.add({.frame = 2,
                .late_loops = {{.frame = 1, .match = 0, .score = 0.995, .similarity = 0.25},
                               {.frame = 0, .earlier_match = SessionFrame{2, 7}, .score = 0.99}},
                .withdrawn_loops = {{.frame = 1, .match = 0, .score = 0.125}},
                .name = "c"});
  }
  EXPECT_EQ(
      test::lines_of(path("run/late_loops.csv")),
      (std::vector<std::string>{kLateLoopsHeader, "1,withdrawn,0,0.125,0.000000,2,,a\\x2cb.png",
                                "1,late,0,0.995,0.250000,2,,a\\x2cb.png",
                                "0,late,2:7,0.99,0.000000,2,a\\x2cb.png,"}));
  const std::vector<Detection> read = read_run(path("run")).detections;
  ASSERT_EQ(read[2].late_loops.size(), 2U);
  EXPECT_EQ(read[2].late_loops[0].match, 0);
  EXPECT_EQ(read[2].late_loops[0].similarity, 0.25);
  EXPECT_EQ(read[2].late_loops[1].earlier_match, (SessionFrame{2, 7}));
  ASSERT_EQ(read[2].withdrawn_loops.size(), 1U);
  EXPECT_EQ(read[2].withdrawn_loops[0].score, 0.125);
  EXPECT_EQ(
      match_list(read).changes,
      (std::vector<ReportedMatch>{{1, 0, 0.125, false}, {1, 0, 0.995, true}, {0, -1, 0.99, true}}));
  EXPECT_TRUE(match_list(read).matches[0].is_loop) << "decisions at once stay as they were";
}

TEST_F(RunFolderTest, LoopsMayBeWithdrawnAfterTheLastFrame) {
  {
    RunFolder folder(path("run"), false);
    folder.add({.frame = 0});
    folder.add({.frame = 1, .status = Status::loop, .match = 0, .score = 0.99, .name = "b"});
    folder.withdraw({{.frame = 1, .match = 0}});
    folder.write_record(stopped_by("end"));
    EXPECT_EQ(folder.detections()[1].withdrawn_loops.size(), 1U);
  }
  EXPECT_EQ(test::lines_of(path("run/late_loops.csv")).back(), "1,withdrawn,0,0,0.000000,1,b,");
  const FinishedRun run = read_run(path("run"));
  EXPECT_FALSE(with_changes(match_list(run.detections)).matches[0].is_loop);
  EXPECT_EQ(run.record->results->withdrawn_loops, 1);
}

TEST_F(RunFolderTest, AChangedRowOfLateLoopsIsNamed) {
  RunFolder(path("run"), false).add({.frame = 0});
  const auto expect_refused = [&](const std::string& row, std::string_view part) {
    const std::string file =
        write("run/late_loops.csv", std::string(kLateLoopsHeader) + "\n" + row + "\n");
    test::expect_error(ErrorKind::input, {file, "line 2", part},
                       [&] { (void)read_run(path("run")); });
  };
  expect_refused("1,late,0,1,0,2,", "7 columns");
  expect_refused("1,later,0,1,0,2,,", "'later'");
  expect_refused("1,late,1,1,0,2,,", "'1'");
  expect_refused("2,late,0,1,0,2,,", "'2'");
  expect_refused("3,withdrawn,0,1,0,2,,", "'2'");
  (void)write("run/late_loops.csv", std::string(kLateLoopsHeader) + "\n2,late,0,1,0,9,,\n");
  EXPECT_EQ(read_run(path("run")).detections.size(), 1U) << "its frame did not reach the disk";
}

TEST_F(RunFolderTest, TruthThatIsHalfWrittenIsNone) {
  RunFolder folder(path("run"), false);
  fs::create_directory(path("run/ignore.csv"));
  test::expect_error(ErrorKind::output, {path("run/ignore.csv")}, [&] {
    folder.write_truth({{{1, 0, 0}}, {}, {2}});
  });
  EXPECT_FALSE(read_run(path("run")).truth.has_value());
}

TEST_F(RunFolderTest, AReplacedRunLeavesNothingBeside) {
  {
    RunFolder folder(path("run"), false);
    folder.write_truth({});
    folder.write_positions({std::nullopt});
    (void)write("run/report.html", "old");
    (void)write("run/evidence.db-wal", "old");
    folder.write_record({});
  }
  RunFolder replaced(path("run"), true);
  replaced.add({.frame = 0, .status = Status::unreadable});
  replaced.write_record(stopped_by("end"));
  EXPECT_EQ(std::distance(fs::directory_iterator(path("run")), {}), 3);
}

/// A run of `frames` unreadable frames that has ended, or as far as it came.
void write_run(const std::string& folder, int frames, const std::string& reason = "end") {
  RunFolder run(folder, true);
  run.write_record(stopped_by(kRunning));
  for (int frame = 0; frame < frames; ++frame) {
    run.add({.frame = frame, .status = Status::unreadable});
  }
  if (reason != kRunning) run.write_record(stopped_by(reason));
}

std::size_t frames_in(const std::string& folder) { return read_run(folder).detections.size(); }

TEST_F(RunFolderTest, ARunWithoutARowReplacesNothing) {
  write_run(path("run"), 3);
  const auto before = test::lines_of(path("run/run.json"));
  for (const char* reason : {kRunning, "interrupt", "The disk is full."}) {
    write_run(path("run"), 0, reason);
    EXPECT_EQ(frames_in(path("run")), 3U);
    EXPECT_EQ(test::lines_of(path("run/run.json")), before);
    EXPECT_EQ(std::distance(fs::directory_iterator(path("run")), {}), 3);
  }
}

TEST_F(RunFolderTest, TheLastRunThatEndedIsKeptUntilAnotherEnds) {
  write_run(path("run"), 3);
  for (const int frames : {1, 2}) {
    write_run(path("run"), frames, frames == 1 ? "The disk is full." : kRunning);
    EXPECT_EQ(frames_in(path("run")), static_cast<std::size_t>(frames));
    EXPECT_EQ(frames_in(path("run/earlier_run")), 3U);
  }
  const std::string own = path("run/earlier_run/loops.csv");
  test::expect_error(ErrorKind::output, {own, "is read"},
                     [&] { const RunFolder over(path("run"), true, {own}); });
  write_run(path("run"), 4, "interrupt");
  EXPECT_EQ(frames_in(path("run")), 4U);
  EXPECT_FALSE(fs::exists(path("run/earlier_run")));
}

TEST_F(RunFolderTest, ARunThatEndedIsKeptThoughAnOlderOneIsStillThere) {
  write_run(path("run/earlier_run"), 3);
  write_run(path("other"), 4);
  for (const char* name : {"loops.csv", "run.json"}) {
    fs::copy(path("other/") + name, path("run/") + name);
  }
  write_run(path("run"), 1, kRunning);
  EXPECT_EQ(frames_in(path("run/earlier_run")), 4U);
}

TEST_F(RunFolderTest, ARunThatACrashLeftHalfMovedIsMovedWhole) {
  for (const bool is_empty_folder_left : {false, true}) {  // of a run before that was removed
    write_run(path("run"), 3);
    if (is_empty_folder_left) fs::create_directory(path("run/earlier_run"));
    fs::create_directory(path("run/earlier_run.part"));
    fs::rename(path("run/run.json"), path("run/earlier_run.part/run.json"));
    write_run(path("run"), 0, kRunning);
    EXPECT_EQ(frames_in(path("run")), 3U);
    EXPECT_TRUE(fs::exists(path("run/run.json")));
  }
  fs::create_directory(path("run/earlier_run.part"));
  for (const char* name : {"late_loops.csv", "loops.csv", "run.json"}) {
    fs::rename(path("run/") + name, path("run/earlier_run.part/") + name);
  }
  test::expect_error(ErrorKind::output, {"earlier_run.part/loops.csv", "--overwrite"},
                     [&] { const RunFolder unasked(path("run"), false); });
  write_run(path("run"), 1, kRunning);
  EXPECT_EQ(frames_in(path("run/earlier_run")), 3U);
}

TEST_F(RunFolderTest, HowARunEndsIsWrittenWhereNothingNewCanBe) {
  RunFolder folder(path("run"), false);
  folder.write_record(stopped_by(kRunning));
  const auto size = fs::file_size(path("run/run.json"));
  fs::create_directories(path("run/run.json.part/x"));  // in the way of any new file
  folder.add({.frame = 0, .status = Status::unreadable});
  folder.write_record(stopped_by("The disk is full."));
  EXPECT_EQ(fs::file_size(path("run/run.json")), size);
  const std::string record = read_run(path("run")).record_json;
  EXPECT_NE(record.find("\"stopped_by\": \"The disk is full.\""), std::string::npos);
  EXPECT_NE(record.find("\"counts\""), std::string::npos);
  test::expect_error(ErrorKind::output, {"run.json"},
                     [&] { folder.write_record(stopped_by(std::string(size, 'x'))); });
}

class EvidenceFileTest : public test::ScratchTest {
 protected:
  /// Evidence about `frames` frames, each of its own.
  std::string write_evidence(int frames) {
    std::string file = path("evidence.db");
    EvidenceWriter writer(file);
    for (int frame = 0; frame < frames; ++frame) {
      writer.add(frame, test::view(frame), evidence(frame));
    }
    writer.finish();
    return file;
  }

  static Evidence evidence(int frame) {
    test::Random random(frame);
    cv::Mat1f saliency(64, 64, 0.0F);
    saliency(frame % 64, 3) = 2.0F;
    Evidence evidence{test::random_content(random, 0.3), saliency, {}};
    for (int i = 0; i < frame; ++i) {
      evidence.inliers.push_back({{0.25F, 0.5F}, {0.125F, static_cast<float>(i)}});
    }
    return evidence;
  }
};

TEST_F(EvidenceFileTest, WhatWasWrittenIsRead) {
  constexpr int kFrames = 70;
  const EvidenceReader reader(write_evidence(kFrames));
  StoredEvidence stored;
  for (const int frame : {0, 1, 31, 32, 69}) {
    ASSERT_TRUE(reader.read(frame, stored)) << frame;
    EXPECT_EQ(stored.content, evidence(frame).content);
    EXPECT_EQ(stored.inliers, evidence(frame).inliers);
    const cv::Mat picture = cv::imdecode(stored.picture_jpeg, cv::IMREAD_UNCHANGED);
    EXPECT_EQ(picture.size(), cv::Size(256, 192));
    const cv::Mat1b saliency = cv::imdecode(stored.saliency_png, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(saliency.size(), cv::Size(64, 64));
    EXPECT_EQ(saliency(frame % 64, 3), 255);
    EXPECT_EQ(cv::countNonZero(saliency), 1);
  }
  EXPECT_FALSE(reader.read(kFrames, stored));
  int frames = 0;
  reader.for_each_content([&](PlaceId frame, const BinaryContent& content) {
    EXPECT_EQ(frame, frames++);
    EXPECT_EQ(content, evidence(frame).content);
  });
  EXPECT_EQ(frames, kFrames);
}

TEST_F(EvidenceFileTest, WhatWasSeenBeforeAnErrorIsSaved) {
  {
    EvidenceWriter writer(path("evidence.db"));
    for (int frame = 0; frame < 5; ++frame) writer.add(frame, test::view(frame), evidence(frame));
  }
  StoredEvidence stored;
  EXPECT_TRUE(EvidenceReader(path("evidence.db")).read(4, stored));
  EXPECT_FALSE(fs::exists(path("evidence.db-wal")));
}

TEST_F(EvidenceFileTest, TakesEveryKindOfImage) {
  EvidenceWriter writer(path("evidence.db"));
  int frame = 0;
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4}) {
    writer.add(
        frame++,
        cv::Mat(100, 3000, type, cv::Scalar::all(CV_MAT_DEPTH(type) == CV_16U ? 25700 : 100)),
        evidence(0));
  }
  writer.finish();
  const EvidenceReader reader(path("evidence.db"));
  StoredEvidence stored;
  for (int i = 0; i < frame; ++i) {
    ASSERT_TRUE(reader.read(i, stored));
    const cv::Mat1b picture = cv::imdecode(stored.picture_jpeg, cv::IMREAD_GRAYSCALE);
    EXPECT_EQ(picture.size(), cv::Size(256, 9)) << i;
    EXPECT_NEAR(picture(4, 128), 100, 2) << i;
  }
}

TEST_F(EvidenceFileTest, ACutOffFileIsReadOrRefused) {
  const std::string file = write_evidence(5);
  const auto size = fs::file_size(file);
  for (std::uintmax_t bytes = size; bytes-- > 0; bytes -= std::min<std::uintmax_t>(bytes, 997)) {
    fs::resize_file(file, bytes);
    try {
      const EvidenceReader reader(file);
      reader.for_each_content([](PlaceId, const BinaryContent&) {});
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_NE(std::string(error.what()).find(file), std::string::npos);
    }
  }
}

TEST(Summarize, LeavesUnreadableFramesOut) {
  std::vector<Detection> detections;
  for (int i = 0; i < 100; ++i) {
    detections.push_back({.status = Status::low_score, .times = {.content_ms = 100.0 - i}});
    detections.push_back({.status = Status::unreadable});
  }
  const TimeSummary times = summarize(detections, &StepTimes::content_ms);
  EXPECT_DOUBLE_EQ(times.mean, 50.5);
  EXPECT_DOUBLE_EQ(times.p50, 50.0);
  EXPECT_DOUBLE_EQ(times.p99, 99.0);
  EXPECT_DOUBLE_EQ(times.max, 100.0);
  EXPECT_EQ(summarize({}, &StepTimes::content_ms).max, 0.0);
}

/// Frames from memory.
class FrameSource final : public ImageSource {
 public:
  explicit FrameSource(std::vector<Frame> frames) : frames_(std::move(frames)) {}
  bool next(Frame& frame) override {
    if (position_ == frames_.size()) return false;
    frame = frames_[position_++];
    return true;
  }
  bool skip() override {
    Frame frame;
    return next(frame);
  }
  [[nodiscard]] std::optional<std::size_t> size() const override { return frames_.size(); }
  [[nodiscard]] std::string description() const override { return "frames"; }

 private:
  std::vector<Frame> frames_;
  std::size_t position_ = 0;
};

struct Told {
  std::vector<Detection> detections;
  std::vector<std::string> sentences;
};

Told run_all(ImageSource& source, int stop_after = -1, int threads = 1) {
  Told told;
  std::atomic<bool> stop{false};
  LoopDetector detector;
  run(source, detector,
      {[&](const Detection& detection) {
         told.detections.push_back(detection);
         stop = static_cast<int>(told.detections.size()) == stop_after;
       },
       [&](const std::string& sentence) { told.sentences.push_back(sentence); }},
      stop, {}, threads);
  return told;
}

std::vector<Frame> frames(int number) {
  std::vector<Frame> list;
  list.reserve(static_cast<std::size_t>(number));
  for (int i = 0; i < number; ++i) {
    list.push_back({"frame " + std::to_string(i), 0.5 * i, test::view(i), {}});
  }
  return list;
}

TEST(Run, BadFramesAreCountedAndTheRunGoesOn) {
  auto list = frames(6);
  list[1] = {"broken.png", 0.5, {}, "'broken.png' is empty."};
  list[2].image = cv::Mat1b(8, 8, std::uint8_t{0});
  list[4].image = cv::Mat1f(240, 320, 0.5F);
  for (const int threads : {1, 2}) {
    SCOPED_TRACE(threads);
    FrameSource source(list);
    const Told told = run_all(source, -1, threads);
    ASSERT_EQ(told.detections.size(), 6U);
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(told.detections[static_cast<std::size_t>(i)].frame, i);
      EXPECT_EQ(told.detections[static_cast<std::size_t>(i)].timestamp_s, 0.5 * i);
      EXPECT_EQ(told.detections[static_cast<std::size_t>(i)].status == Status::unreadable,
                i == 1 || i == 2 || i == 4);
    }
    ASSERT_EQ(told.sentences.size(), 3U);
    EXPECT_EQ(told.sentences[0], "Frame 1: 'broken.png' is empty.");
    EXPECT_NE(told.sentences[1].find("8 x 8"), std::string::npos);
    EXPECT_NE(told.sentences[2].find("frame 4"), std::string::npos);
  }
}

/// What a run comes to whose window is 5 seconds and whose frame `untimed` of three has no time.
std::vector<Status> run_without_a_time(std::size_t untimed) {
  auto list = frames(3);
  list[untimed].timestamp_s.reset();
  FrameSource source(list);
  LoopDetectorOptions options;
  options.exclusion.seconds = 5;
  LoopDetector detector(options);
  std::vector<Status> seen;
  run(source, detector,
      {[&](const Detection& d) { seen.push_back(d.status); }, [](const std::string&) {}}, false);
  return seen;
}

TEST(Run, FramesWithoutTimesEndItWhereASettingIsInSeconds) {
  test::expect_error(ErrorKind::option, {"exclusion.seconds is 5", "frame 0"},
                     [] { (void)run_without_a_time(0); });
}

TEST(Run, ALaterFrameWithoutATimeIsLeftOut) {
  EXPECT_EQ(run_without_a_time(1),
            (std::vector{Status::no_earlier_place, Status::unreadable, Status::no_earlier_place}));
}

/// The detections of a window of one frame; `on_evidence` may be empty.
std::vector<Detection> detect_all(
    const std::vector<Frame>& list,
    const std::function<void(const Detection&, const cv::Mat&, const Evidence&)>& on_evidence,
    int threads = 1) {
  FrameSource source(list);
  LoopDetectorOptions options;
  options.exclusion.frames = 1;
  options.exclusion.min_frames = 1;
  LoopDetector detector(options);
  std::vector<Detection> detections;
  const std::atomic<bool> stop{false};
  run(source, detector,
      {[&](const Detection& detection) { detections.push_back(detection); },
       [](const std::string&) {}, on_evidence},
      stop, {}, threads);
  return detections;
}

/// Three views, the second of them unreadable, and the same views again.
std::vector<Frame> two_rounds() {
  auto list = frames(6);
  for (std::size_t i = 3; i < list.size(); ++i) list[i].image = test::view(static_cast<int>(i) - 3);
  list[1] = {"broken.png", 0.5, {}, "'broken.png' is empty."};
  return list;
}

TEST(Run, TellsWhatADetectionRestsOn) {
  std::vector<PlaceId> told;
  int most_inliers = 0;
  (void)detect_all(two_rounds(),
                   [&](const Detection& d, const cv::Mat& image, const Evidence& seen) {
                     told.push_back(d.frame);
                     most_inliers = std::max(most_inliers, d.inliers);
                     EXPECT_EQ(static_cast<int>(seen.inliers.size()), d.inliers);
                     EXPECT_EQ(seen.content, binary_content(image));
                     for (const PointPair& pair : seen.inliers) {
                       EXPECT_TRUE(cv::Rect2f(0, 0, 1, 1).contains(pair.query));
                       EXPECT_TRUE(cv::Rect2f(0, 0, 1, 1).contains(pair.match));
                     }
                   });
  EXPECT_EQ(told, (std::vector<PlaceId>{0, 2, 3, 4, 5}));
  EXPECT_GT(most_inliers, 8);
}

TEST(Run, FramesMayDifferInSize) {
  auto list = two_rounds();
  for (std::size_t i = 3; i < list.size(); ++i) {
    const cv::Mat cropped = list[i].image(cv::Rect(0, 20, 320, 200));
    cv::resize(cropped, list[i].image, {}, 1.5, 1.5, cv::INTER_LINEAR);
  }
  int compared = 0;
  int right = 0;
  const auto detections =
      detect_all(list, [&](const Detection& d, const cv::Mat& /*image*/, const Evidence& seen) {
        if (d.frame != 3 && d.frame != 5) return;  // what 4 shows was unreadable
        for (const PointPair& pair : seen.inliers) {
          const float off_px = std::abs(pair.match.y * 240 - 20 - pair.query.y * 200);
          if (std::abs(pair.match.x - pair.query.x) < 0.02F && off_px < 5) ++right;
          ++compared;
        }
      });
  EXPECT_EQ(detections[3].match, 0);
  EXPECT_EQ(detections[5].match, 2);
  EXPECT_GT(compared, 30);
  EXPECT_GE(right, 0.9 * compared);
}

TEST(Run, ToldOrNotTheDecisionsAreTheSame) {
  const auto with =
      detect_all(two_rounds(), [](const Detection&, const cv::Mat&, const Evidence& /*seen*/) {});
  const auto without = detect_all(two_rounds(), {});
  ASSERT_EQ(with.size(), without.size());
  for (std::size_t i = 0; i < with.size(); ++i) {
    EXPECT_EQ(with[i].status, without[i].status);
    EXPECT_EQ(with[i].match, without[i].match);
    EXPECT_EQ(with[i].score, without[i].score);
  }
}

TEST(Run, AnotherThreadThatPreparesFramesChangesNoDecision) {
  std::vector<BinaryContent> contents;
  const auto note = [&](const Detection&, const cv::Mat& image, const Evidence& seen) {
    EXPECT_EQ(seen.content, binary_content(image));
    contents.push_back(seen.content);
  };
  const auto alone = detect_all(two_rounds(), note);
  const auto contents_alone = std::exchange(contents, {});
  const auto with_another = detect_all(two_rounds(), note, 2);
  EXPECT_EQ(contents, contents_alone);
  ASSERT_EQ(with_another.size(), alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(with_another[i].name, alone[i].name);
    EXPECT_EQ(with_another[i].status, alone[i].status);
    EXPECT_EQ(with_another[i].match, alone[i].match);
    EXPECT_EQ(with_another[i].score, alone[i].score);
  }
}

TEST(Run, StopsWhenAsked) {
  for (const int threads : {1, 2}) {
    FrameSource source(frames(10));
    EXPECT_EQ(run_all(source, 4, threads).detections.size(), 4U);
  }
}

TEST(Prefetch, GivesTheSameFramesInTheSameOrder) {
  const auto list = frames(20);
  for (const std::size_t depth : {1U, 3U, 50U}) {
    const auto source = prefetch(std::make_unique<FrameSource>(list), depth);
    EXPECT_EQ(source->size(), 20U);
    EXPECT_EQ(source->description(), "frames");
    Frame frame;
    for (const Frame& expected : list) {
      ASSERT_TRUE(source->next(frame));
      EXPECT_EQ(frame.name, expected.name);
      EXPECT_EQ(cv::norm(frame.image, expected.image, cv::NORM_INF), 0.0);
    }
    EXPECT_FALSE(source->next(frame));
    EXPECT_FALSE(source->next(frame));
  }
}

TEST(Prefetch, CanBeLeftBeforeTheEnd) {
  const auto source = prefetch(std::make_unique<FrameSource>(frames(20)), 2);
  Frame frame;
  EXPECT_TRUE(source->next(frame));
  EXPECT_TRUE(source->skip());
  EXPECT_TRUE(source->next(frame));
  EXPECT_EQ(frame.name, "frame 2");
}

/// Fails at its third frame.
class FailingSource final : public ImageSource {
 public:
  bool next(Frame& frame) override {
    frame = {};
    if (++frames_ == 3) throw Error(ErrorKind::input, "The cable is out.");
    return true;
  }
  bool skip() override { return false; }
  [[nodiscard]] std::optional<std::size_t> size() const override { return std::nullopt; }
  [[nodiscard]] std::string description() const override { return "failing"; }

 private:
  int frames_ = 0;
};

TEST(Prefetch, PassesErrorsOnInTheirPlace) {
  EXPECT_THROW(prefetch(std::make_unique<FailingSource>(), 0), Error);
  const auto source = prefetch(std::make_unique<FailingSource>(), 8);
  Frame frame;
  EXPECT_TRUE(source->next(frame));
  EXPECT_TRUE(source->next(frame));
  EXPECT_THROW(source->next(frame), Error);
  EXPECT_FALSE(source->next(frame));
}

TEST(Run, AnInputThatFailsEndsItWithAnyNumberOfThreads) {
  for (const int threads : {1, 2}) {
    FailingSource source;
    test::expect_error(ErrorKind::input, {"The cable is out."},
                       [&] { (void)run_all(source, -1, threads); });
  }
}

}  // namespace
}  // namespace loopbit
