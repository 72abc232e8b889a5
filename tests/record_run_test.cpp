// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/record_run.hpp"

#include <atomic>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "loopbit/finished_run.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

constexpr int kFrames = 3;
const std::atomic<bool> kNeverStop{false};

/// Three views, then the end, or an error.
class ThreeViews final : public ImageSource {
 public:
  explicit ThreeViews(bool fails = false) : fails_(fails) {}

  bool next(Frame& frame) override {
    if (position_ == kFrames && fails_) throw Error(ErrorKind::input, "The cable is out.");
    if (position_ == kFrames) return false;
    frame = {};
    frame.image = test::view(position_++);
    return true;
  }
  bool skip() override { return position_++ < kFrames; }
  [[nodiscard]] std::optional<std::size_t> size() const override { return kFrames; }
  [[nodiscard]] std::string description() const override { return "three views"; }

 private:
  bool fails_;
  int position_ = 0;
};

class RecordRunTest : public test::ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    request_.options = test::fast_options();
    request_.folder = path("run");
    request_.evidence = false;
  }

  void in_map() {
    request_.folder.clear();
    request_.map = path("town.db");
  }

  /// Runs `source`, which is called "views".
  template <typename Source>
  RunOutcome run(Source source, const Sampling& sampling = {},
                 const std::atomic<bool>& stop = kNeverStop) {
    RunInput input(std::make_unique<Source>(std::move(source)), "views", sampling);
    return record_run(input, request_, listener_, stop);
  }

  RunRequest request_;
  RunListener listener_{[](const Detection&) {}, [](const std::string&) {}};
};

TEST_F(RecordRunTest, ACameraThatDoesNotFitBeginsNoSession) {
  in_map();
  request_.camera = CameraModel{.size_px = {64, 48}, .fx = 50, .fy = 50, .cx = 32, .cy = 24};
  request_.camera_file = "left.yaml";
  try {
    run(ThreeViews());
    FAIL() << "the camera was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_NE(std::string(error.what()).find("'left.yaml' is for images of 64 x 48 px"),
              std::string::npos)
        << error.what();
  }
  EXPECT_FALSE(std::filesystem::exists(path("town.db")));
}

TEST_F(RecordRunTest, ARunThatIsCutOffTellsWhatItRead) {
  listener_.on_detection = [&](const Detection&) {
    const std::string begun = read_run(path("run")).record_json;
    EXPECT_NE(begun.find("\"stopped_by\": \"running\""), std::string::npos) << begun;
    EXPECT_NE(begun.find("\"every\": 2"), std::string::npos) << begun;
    EXPECT_EQ(begun.find("\"counts\""), std::string::npos) << begun;
  };
  request_.truth = {.same_place = {{4, 0, 0}}, .every = 2};
  EXPECT_EQ(run(ThreeViews(), {.every = 2}).record.score->decision.positives, 1);
  const FinishedRun whole = read_run(path("run"));
  EXPECT_EQ(whole.truth->same_place, (std::vector<PlaceRun>{{4, 0, 0}}));
  EXPECT_EQ(whole.truth->every, 2);
}

TEST_F(RecordRunTest, LeavesWhatItDetected) {
  int told = 0;
  listener_.on_detection = [&](const Detection& detection) {
    EXPECT_EQ(detection.frame, told++);
    EXPECT_EQ(read_run(path("run")).detections.size(), static_cast<std::size_t>(told));
  };
  request_.evidence = true;
  request_.truth = {.same_place = {{2, 0, 0}}};
  request_.truth_description = "by hand";
  request_.positions_m = {cv::Vec3d(1, 2, 3), std::nullopt, std::nullopt};
  const RunOutcome outcome = run(ThreeViews());
  EXPECT_EQ(told, kFrames);
  EXPECT_GT(outcome.record.wall_s, 0);
  EXPECT_FALSE(outcome.fault.has_value());
  const FinishedRun run = read_run(outcome.folder);
  EXPECT_EQ(run.positions_m[0], cv::Vec3d(1, 2, 3));
  EXPECT_EQ(run.truth->same_place.size(), 1U);
  EXPECT_FALSE(run.evidence_path.empty());
  EXPECT_EQ(run.record->stopped_by, "end");
  EXPECT_EQ(run.record->truth, "by hand");
  EXPECT_EQ(run.record->score->decision.positives, 1);
}

TEST_F(RecordRunTest, ACorrectionNeedsOdometry) {
  request_.correct = true;
  const RunOutcome outcome = run(ThreeViews());
  ASSERT_TRUE(outcome.fault);
  EXPECT_NE(std::string(outcome.fault->what()).find("No frame has odometry"), std::string::npos);
  EXPECT_FALSE(outcome.record.correction);
  EXPECT_FALSE(std::filesystem::exists(path("run/corrected.tum")));
}

TEST_F(RecordRunTest, ContinuesAMapAndIsKeptBesideIt) {
  in_map();
  for (int session = 1; session <= 2; ++session) {
    const RunOutcome outcome = run(ThreeViews());
    EXPECT_EQ(outcome.folder, path("town_session_" + std::to_string(session)));
    EXPECT_EQ(outcome.record.map_session, session);
  }
  EXPECT_EQ(test::places_of(path("town.db")).size(), 2U * kFrames);
}

TEST_F(RecordRunTest, AnErrorClosesTheMapAndKeepsWhatItHas) {
  in_map();
  request_.evidence = true;
  test::expect_error(ErrorKind::input, {"cable"}, [&] { run(ThreeViews(true)); });
  const FinishedRun kept = read_run(path("town_session_1"));
  EXPECT_EQ(kept.detections.size(), std::size_t{kFrames});
  EXPECT_EQ(kept.record->stopped_by, "The cable is out.");
  const MapWriter next(path("town.db"), test::fast_options(), "next");
  EXPECT_EQ(test::places_of(path("town.db")).size(), std::size_t{kFrames});
}

TEST_F(RecordRunTest, AListenerMayEndARunByAnyException) {
  listener_.on_detection = [](const Detection&) { throw std::runtime_error("enough"); };
  EXPECT_THROW(run(ThreeViews()), std::runtime_error);
  EXPECT_EQ(read_run(path("run")).record->stopped_by, "enough");
  EXPECT_EQ(read_run(path("run")).detections.size(), 1U);
}

TEST_F(RecordRunTest, AStopEndsARunInOrder) {
  std::atomic<bool> stop{false};
  listener_.on_detection = [&](const Detection& detection) { stop = detection.frame == 1; };
  request_.truth = {.same_place = {{1, 0, 0}}};
  request_.positions_m = Positions(kFrames, cv::Vec3d(1, 2, 3));
  const RunOutcome outcome = run(ThreeViews(), {}, stop);
  EXPECT_FALSE(outcome.fault.has_value());
  const FinishedRun run = read_run(path("run"));
  EXPECT_EQ(run.record->stopped_by, "interrupt");
  EXPECT_EQ(run.record->score->decision.positives, 1);
  EXPECT_EQ(run.positions_m.size(), 2U);
}

TEST_F(RecordRunTest, WhatRefusesARunCostsNoEarlierOne) {
  run(ThreeViews());
  request_.overwrite = true;
  request_.map = path("town.db");
  {
    const MapWriter busy(path("town.db"), test::fast_options(), "busy");
    test::expect_error(ErrorKind::output, {"being written"}, [&] { run(ThreeViews()); });
  }
  request_.map.clear();
  request_.keep_images = true;
  test::expect_error(ErrorKind::option, {"keep_images", "give map"}, [&] { run(ThreeViews()); });
  request_.keep_images = false;
  request_.poses = write("poses.txt", "1 0 0\n");
  test::expect_error(ErrorKind::input, {"poses.txt", "line 1"}, [&] { run(ThreeViews()); });
  request_.folder.clear();
  test::expect_error(ErrorKind::option, {"folder or a map"}, [&] { run(ThreeViews()); });
  EXPECT_EQ(read_run(path("run")).detections.size(), std::size_t{kFrames});
}

TEST_F(RecordRunTest, WhatIsWrongInTheEndLeavesTheRun) {
  request_.truth = {.same_place = {{2, 0, 0}}};
  request_.positions_m = Positions(7);  // how many frames come is not sure
  const RunOutcome outcome = run(ThreeViews());
  ASSERT_TRUE(outcome.fault.has_value());
  EXPECT_EQ(outcome.fault->kind(), ErrorKind::option);
  EXPECT_NE(std::string(outcome.fault->what()).find("7 rows, but there are 3 frames"),
            std::string::npos);
  EXPECT_EQ(outcome.record.stopped_by, "end");
  EXPECT_TRUE(outcome.record.score.has_value());
  EXPECT_TRUE(read_run(path("run")).positions_m.empty());
}

TEST_F(RecordRunTest, FilesDoNotCountFromTheMiddle) {
  RunInput input(std::make_unique<ThreeViews>(), "views");
  EXPECT_TRUE(input.skip());
  request_.scoring.truth = write("truth.csv", "2,0\n");
  test::expect_error(ErrorKind::option, {"truth.csv", "1 frame of 'views'", "open it again"},
                     [&] { record_run(input, request_, listener_, kNeverStop); });
  request_.scoring.truth.clear();
  EXPECT_EQ(record_run(input, request_, listener_, kNeverStop).detections.size(), 2U);
}

/// Two frames that can be read, but are too small for any detector.
class TinyViews final : public ImageSource {
 public:
  bool next(Frame& frame) override {
    frame = {.name = "tiny", .timestamp_s = {}, .image = cv::Mat1b(20, 20, uchar{9}), .error = ""};
    return left_-- > 0;
  }
  bool skip() override { return left_-- > 0; }
  [[nodiscard]] std::optional<std::size_t> size() const override { return 2; }
  [[nodiscard]] std::string description() const override { return "two tiny views"; }

 private:
  int left_ = 2;
};

/// Frames that no one can read, before three views or none.
class BadBegin final : public ImageSource {
 public:
  explicit BadBegin(bool has_views) : has_views_(has_views) {}

  bool next(Frame& frame) override {
    if (bad_-- <= 0) return has_views_ && views_.next(frame);
    frame = {.name = "bad", .timestamp_s = {}, .image = {}, .error = "It is no image."};
    return true;
  }
  bool skip() override { return bad_-- > 0 || (has_views_ && views_.skip()); }
  [[nodiscard]] std::optional<std::size_t> size() const override { return std::nullopt; }
  [[nodiscard]] std::string description() const override { return "a bad beginning"; }

 private:
  bool has_views_;
  int bad_ = 2;
  ThreeViews views_;
};

TEST_F(RecordRunTest, ARunWithoutAReadableFrameIsRefusedWhenItHasEnded) {
  request_.map = path("town.db");
  test::expect_error(ErrorKind::input, {"No frame", "'views'"}, [&] { run(BadBegin(false)); });
  EXPECT_EQ(read_run(path("run")).detections.size(), 2U);
  const MapWriter next(path("town.db"), test::fast_options(), "next");
  request_.map.clear();
  request_.folder = path("other");
  EXPECT_EQ(run(BadBegin(false), {}, std::atomic<bool>{true}).record.stopped_by, "interrupt");
}

TEST(RunInput, AProvenInputGivesTheSameFrames) {
  RunInput input(std::make_unique<BadBegin>(true), "views");
  EXPECT_FALSE(input.prove().image.empty());
  EXPECT_FALSE(input.prove().image.empty());
  EXPECT_EQ(input.taken(), 0U);
  Frame frame;
  EXPECT_TRUE(input.next(frame));
  EXPECT_EQ(frame.error, "It is no image.");
  EXPECT_TRUE(input.skip());
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(input.next(frame));
    EXPECT_FALSE(frame.image.empty());
  }
  EXPECT_FALSE(input.next(frame));
  EXPECT_FALSE(input.skip());
  EXPECT_EQ(input.taken(), 2U + kFrames);
  RunInput tiny(std::make_unique<TinyViews>(), "views");
  test::expect_error(ErrorKind::input, {"No frame of 'views'", "'tiny'", "20 x 20"},
                     [&] { tiny.prove(); });
  RunInput bad(std::make_unique<BadBegin>(false), "views");
  for (int i = 0; i < 2; ++i) {
    test::expect_error(ErrorKind::input, {"No frame of 'views'", "It is no image."},
                       [&] { bad.prove(); });
  }
}

}  // namespace
}  // namespace loopbit
