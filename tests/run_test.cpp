// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <fstream>
#include <utility>

#include "loopbit/run_folder.hpp"
#include "loopbit/runner.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

class RunFolderTest : public test::ScratchTest {};

TEST_F(RunFolderTest, RowsAreOnDiskAtOnce) {
  RunFolder folder(path("run"), false);
  folder.add({.frame = 0, .timestamp_s = 12.5, .status = Status::no_earlier_place});
  folder.add({.frame = 1,
              .status = Status::loop,
              .match = 0,
              .score = 20.5,
              .similarity = 0.25,
              .matches = 30,
              .inliers = 21,
              .times = {1.0, 0.5, 12.25, 3.0}});
  EXPECT_EQ(
      lines_of(path("run/loops.csv")),
      (std::vector<std::string>{
          kLoopsHeader, "0,12.500000,no_earlier_place,,0,0.000000,0,0,0.000,0.000,0.000,0.000",
          "1,,loop,0,20.5,0.250000,30,21,1.000,0.500,12.250,3.000"}));
}

TEST_F(RunFolderTest, NeverReplacesARunUnasked) {
  RunFolder(path("run"), false).add({.frame = 0, .status = Status::unreadable});
  const auto before = lines_of(path("run/loops.csv"));
  test::expect_error(ErrorKind::output, {path("run"), "--overwrite"},
                     [&] { const RunFolder again(path("run"), false); });
  EXPECT_EQ(lines_of(path("run/loops.csv")), before);
  const RunFolder replaced(path("run"), true);
  EXPECT_EQ(lines_of(path("run/loops.csv")), std::vector<std::string>{kLoopsHeader});
}

TEST_F(RunFolderTest, OverwritingKeepsOtherFiles) {
  RunFolder(path("run"), false).finish({});
  (void)write("run/notes.txt", "mine");
  const RunFolder replaced(path("run"), true);
  EXPECT_TRUE(fs::exists(path("run/notes.txt")));
  EXPECT_FALSE(fs::exists(path("run/run.json")));
}

TEST_F(RunFolderTest, AFolderThatCannotBeMadeIsNamed) {
  const std::string file = write("file", "");
  test::expect_error(ErrorKind::output, {file}, [&] { RunFolder(file + "/run", false); });
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

Told run_all(ImageSource& source, int stop_after = -1) {
  Told told;
  std::atomic<bool> stop{false};
  LoopDetector detector;
  run(source, detector,
      {[&](const Detection& detection) {
         told.detections.push_back(detection);
         stop = static_cast<int>(told.detections.size()) == stop_after;
       },
       [&](const std::string& sentence) { told.sentences.push_back(sentence); }},
      stop);
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
  list[2].image = test::textured_image({200, 100}, 2);
  list[4].image = cv::Mat1f(240, 320, 0.5F);
  FrameSource source(list);
  const Told told = run_all(source);
  ASSERT_EQ(told.detections.size(), 6U);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(told.detections[static_cast<std::size_t>(i)].frame, i);
    EXPECT_EQ(told.detections[static_cast<std::size_t>(i)].timestamp_s, 0.5 * i);
    EXPECT_EQ(told.detections[static_cast<std::size_t>(i)].status == Status::unreadable,
              i == 1 || i == 2 || i == 4);
  }
  ASSERT_EQ(told.sentences.size(), 3U);
  EXPECT_EQ(told.sentences[0], "Frame 1: 'broken.png' is empty.");
  EXPECT_NE(told.sentences[1].find("200 x 100"), std::string::npos);
  EXPECT_NE(told.sentences[2].find("frame 4"), std::string::npos);
}

TEST(Run, TheSizeIsThatOfTheFirstUsableFrame) {
  auto list = frames(3);
  list[0] = {"tiny.png", 0.0, cv::Mat1b(8, 8, std::uint8_t{0}), {}};
  FrameSource source(list);
  const Told told = run_all(source);
  EXPECT_EQ(told.detections[0].status, Status::unreadable);
  EXPECT_NE(told.detections[1].status, Status::unreadable);
  EXPECT_NE(told.detections[2].status, Status::unreadable);
}

TEST(Run, StopsWhenAsked) {
  FrameSource source(frames(10));
  EXPECT_EQ(run_all(source, 4).detections.size(), 4U);
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
  const auto source = prefetch(std::make_unique<FailingSource>(), 8);
  Frame frame;
  EXPECT_TRUE(source->next(frame));
  EXPECT_TRUE(source->next(frame));
  EXPECT_THROW(source->next(frame), Error);
  EXPECT_FALSE(source->next(frame));
}

}  // namespace
}  // namespace loopbit
