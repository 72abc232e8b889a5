// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/recorded_run.hpp"

#include <atomic>
#include <filesystem>
#include <memory>

#include "loopbit/finished_run.hpp"
#include "loopbit/provable_source.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

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

RunListener nobody() {
  return {[](const Detection&) {}, [](const std::string&) {}};
}

class RecordedRunTest : public test::ScratchTest {
 protected:
  [[nodiscard]] RunRecord record(const std::string& map = "") const {
    return {.input = "views",
            .description = "three views",
            .options = test::fast_options(),
            .map_path = map.empty() ? "" : path(map)};
  }
};

TEST_F(RecordedRunTest, ARunThatIsCutOffTellsWhatItRead) {
  RunRecord of_half = record();
  of_half.every = 2;
  ThreeViews source;
  RecordedRun recorded(of_half, {path("run")});
  recorded.detect(source, nobody(), false, kNeverStop);
  const std::string begun = read_run(path("run")).record_json;
  EXPECT_NE(begun.find("\"stopped_by\": \"running\""), std::string::npos) << begun;
  EXPECT_NE(begun.find("\"every\": 2"), std::string::npos) << begun;
  EXPECT_EQ(begun.find("\"counts\""), std::string::npos) << begun;
  recorded.score({.same_place = {{4, 0, 0}}, .every = 2}, {});
  const FinishedRun cut_off = read_run(path("run"));
  EXPECT_EQ(cut_off.truth->same_place, (std::vector<PlaceRun>{{4, 0, 0}}));
  EXPECT_EQ(cut_off.truth->every, 2);
}

TEST_F(RecordedRunTest, LeavesWhatItDetected) {
  ThreeViews source;
  RecordedRun recorded(record(), {path("run")});
  int told = 0;
  recorded.detect(source,
                  {.on_detection =
                       [&](const Detection& detection) {
                         EXPECT_EQ(detection.frame, told++);
                         EXPECT_EQ(read_run(path("run")).detections.size(),
                                   static_cast<std::size_t>(told));
                       },
                   .on_bad_frame = nobody().on_bad_frame},
                  true, kNeverStop);
  recorded.keep_positions({cv::Vec3d(1, 2, 3), std::nullopt, std::nullopt});
  recorded.score({{{2, 0, 0}}, {}, {}}, {});
  recorded.finish("end");
  EXPECT_EQ(told, kFrames);
  EXPECT_GT(recorded.record().wall_s, 0);
  const FinishedRun run = read_run(path("run"));
  EXPECT_EQ(run.positions_m[0], cv::Vec3d(1, 2, 3));
  EXPECT_EQ(run.truth->same_place.size(), 1U);
  EXPECT_FALSE(run.evidence_path.empty());
  EXPECT_NE(run.record_json.find("\"stopped_by\": \"end\""), std::string::npos);
  EXPECT_EQ(recorded.record().score->decision.positives, 1);
}

TEST_F(RecordedRunTest, ContinuesAMapAndIsKeptBesideIt) {
  for (int session = 1; session <= 2; ++session) {
    ThreeViews source;
    RecordedRun recorded(record("town.db"), {});
    recorded.detect(source, nobody(), false, kNeverStop);
    recorded.finish("end");
    EXPECT_EQ(recorded.folder().path(), path("town_session_" + std::to_string(session)));
    EXPECT_EQ(recorded.record().map_session, session);
  }
  EXPECT_EQ(test::places_of(path("town.db")).size(), 2U * kFrames);
}

TEST_F(RecordedRunTest, AnErrorClosesTheMapAndKeepsWhatItHas) {
  ThreeViews source(true);
  RecordedRun recorded(record("town.db"), {});
  test::expect_error(ErrorKind::input, {"cable"},
                     [&] { recorded.detect(source, nobody(), true, kNeverStop); });
  recorded.finish("The cable is out.");
  EXPECT_EQ(read_run(recorded.folder().path()).detections.size(), std::size_t{kFrames});
  const MapWriter next(path("town.db"), test::fast_options(), "next");
  EXPECT_EQ(test::places_of(path("town.db")).size(), std::size_t{kFrames});
}

TEST_F(RecordedRunTest, WhatRefusesARunCostsNoEarlierOne) {
  { const RecordedRun earlier(record("town.db"), {path("run")}); }
  const MapWriter busy(path("town.db"), test::fast_options(), "busy");
  test::expect_error(ErrorKind::output, {"being written"}, [&] {
    const RecordedRun run(record("town.db"), {path("run"), true});
  });
  EXPECT_TRUE(fs::exists(path("run/loops.csv")));
  test::expect_error(ErrorKind::option, {"folder or a map"},
                     [&] { const RecordedRun run(record(), {}); });
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

TEST_F(RecordedRunTest, ARunWithoutAReadableFrameIsRefusedWhenItHasEnded) {
  BadBegin source(false);
  RecordedRun recorded(record("town.db"), {path("run")});
  test::expect_error(ErrorKind::input, {"None of the 2 frames", "'views'"},
                     [&] { recorded.detect(source, nobody(), false, kNeverStop); });
  EXPECT_EQ(read_run(path("run")).detections.size(), 2U);
  const MapWriter next(path("town.db"), test::fast_options(), "next");
  BadBegin stopped(false);
  RecordedRun other(record(), {path("other")});
  const std::atomic<bool> stop{true};
  other.detect(stopped, nobody(), false, stop);
}

TEST_F(RecordedRunTest, AProvenSourceGivesTheSameFrames) {
  ProvableSource source(std::make_unique<BadBegin>(true));
  EXPECT_FALSE(source.prove("views").image.empty());
  EXPECT_FALSE(source.prove("views").image.empty());
  Frame frame;
  EXPECT_TRUE(source.next(frame));
  EXPECT_EQ(frame.error, "It is no image.");
  EXPECT_TRUE(source.skip());
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(source.next(frame));
    EXPECT_FALSE(frame.image.empty());
  }
  EXPECT_FALSE(source.next(frame));
  EXPECT_FALSE(source.skip());
  ProvableSource tiny(std::make_unique<TinyViews>());
  test::expect_error(ErrorKind::input, {"None of the 2 frames of 'views'", "'tiny'", "20 x 20"},
                     [&] { tiny.prove("views"); });
  ProvableSource bad(std::make_unique<BadBegin>(false));
  for (int i = 0; i < 2; ++i) {
    test::expect_error(ErrorKind::input, {"None of the 2 frames of 'views'", "It is no image."},
                       [&] { bad.prove("views"); });
  }
}

}  // namespace
}  // namespace loopbit
