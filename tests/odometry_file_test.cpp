// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "odometry_file.hpp"

#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/record_run.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

constexpr const char* kCovariance = "4 0 0 0 0 0 4 0 0 0 0 4 0 0 0 1 0 0 1 0 1";

Frame frame_at(std::optional<double> time_s) {
  Frame frame;
  frame.name = "view.png";
  frame.timestamp_s = time_s;
  return frame;
}

/// Of a trajectory along x, one row per metre.
std::string tum_rows(int count, double first_s, double step_s, const std::string& more = "") {
  std::string text;
  for (int i = 0; i < count; ++i) {
    text += fmt::format("{} {} 0 0 0 0 0 1 {}\n", first_s + i * step_s, i, more);
  }
  return text;
}

class OdometryFileTest : public test::ScratchTest {
 protected:
  [[nodiscard]] OdometryFile open(const std::string& text, int every = 1,
                                  std::optional<double> first_s = 10) const {
    return {write("odometry.txt", text), {.every = every}, frame_at(first_s)};
  }

  [[nodiscard]] std::string fault(const std::string& text, int every = 1,
                                  std::optional<double> first_s = 10) const {
    try {
      (void)open(text, every, first_s);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      return error.what();
    }
    return "";
  }
};

/// Its x, or -1 without a pose.
double x_of(const std::optional<OdometryPose>& pose) {
  return pose ? pose->T_odometry_camera(0, 3) : -1;
}

TEST_F(OdometryFileTest, FramesGetThePoseNearestInTime) {
  OdometryFile file = open(tum_rows(10, 10, 0.1));
  EXPECT_EQ(x_of(file.next(frame_at(9.9))), -1);  // too early
  EXPECT_EQ(x_of(file.next(frame_at(10.14))), 1);
  EXPECT_EQ(x_of(file.next(frame_at(std::nullopt))), -1);
  EXPECT_EQ(x_of(file.next(frame_at(10.46))), 5);
  EXPECT_EQ(x_of(file.next(frame_at(10.951))), -1);  // too late
  EXPECT_NO_THROW(file.check_used());
}

TEST_F(OdometryFileTest, RowsWithoutTimesBelongToEveryNthFrame) {
  std::string text;
  for (int i = 0; i < 6; ++i) text += fmt::format("1 0 0 {} 0 1 0 0 0 0 1 0\n", i);
  OdometryFile file = open(text, 2);
  for (const double x : {0, 2, 4, -1}) EXPECT_EQ(x_of(file.next(frame_at(std::nullopt))), x);
}

TEST_F(OdometryFileTest, ReadsEuroc) {
  OdometryFile file = open(
      "timestamp,px,py,pz,qw,qx,qy,qz,vx,vy,vz,bx,by,bz,ax,ay,az\n"
      "10000000000,7,8,9,0.5,0.5,0.5,0.5,0,0,0,0,0,0,0,0,0\n");
  const auto pose = file.next(frame_at(10));
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->T_odometry_camera, cv::Matx44d(0, 0, 1, 7, 1, 0, 0, 8, 0, 1, 0, 9, 0, 0, 0, 1));
  EXPECT_FALSE(pose->covariance);
}

TEST_F(OdometryFileTest, CovariancesOfRowsBetweenFramesAddUp) {
  OdometryFile file = open(tum_rows(10, 10, 0.1, kCovariance));
  EXPECT_FALSE(file.next(frame_at(10.1)).value().covariance) << "of a motion since nothing";
  // Three rows: the rotations of the first two act over 2 m and 1 m.
  const cv::Matx66d sum = file.next(frame_at(10.4)).value().covariance.value();
  EXPECT_NEAR(sum(0, 0), 3 * 4, 1e-9);
  EXPECT_NEAR(sum(1, 1), 3 * 4 + 2 * 2 + 1 * 1, 1e-9);
  EXPECT_NEAR(sum(3, 3), 3, 1e-9);
  EXPECT_FALSE(file.next(frame_at(10.41)).value().covariance) << "the same row again";
}

TEST_F(OdometryFileTest, FaultsAreNamed) {
  EXPECT_EQ(fault(tum_rows(3, 10, 0.1)), "");
  const auto has = [&](const std::string& what, const std::string& word) {
    EXPECT_NE(what.find(word), std::string::npos) << what;
    EXPECT_NE(what.find(path("odometry.txt")), std::string::npos) << what;
  };
  has(fault("10 0 0 0 0 0 0 1\n10.1 0 0 0 0 0 0 2\n"), "line 2");
  has(fault(tum_rows(2, 10, 0.1) + tum_rows(1, 9, 0.1)), "goes back in time at pose 3");
  has(fault(tum_rows(3, 5, 0.1)), "ends at 5.2");
  has(fault(tum_rows(3, 5, 0.1), 1, std::nullopt), "'view.png' has no time");
  has(fault(tum_rows(2, 10, 0.1, "4 9" + std::string(kCovariance).substr(3))), "pose 2");
  has(fault("# nothing\n"), "has no pose");
  OdometryFile late = open(tum_rows(3, 50, 0.1));
  EXPECT_NO_THROW(late.check_used());  // of no frame yet
  EXPECT_FALSE(late.next(frame_at(10)));
  EXPECT_THROW(late.check_used(), Error);
}

/// Some views, 0.1 s apart.
class TimedViews final : public ImageSource {
 public:
  bool next(Frame& frame) override {
    if (position_ == 4) return false;
    frame = frame_at(10 + 0.1 * position_);
    if (position_ == 2) frame.error = "is damaged";
    frame.image = test::view(position_++);
    return true;
  }
  bool skip() override { return position_++ < 4; }
  [[nodiscard]] std::optional<std::size_t> size() const override { return 4; }
  [[nodiscard]] std::string description() const override { return "views"; }

 private:
  int position_ = 0;
};

class RunWithOdometryTest : public OdometryFileTest {
 protected:
  RunOutcome run(const std::string& text) {
    RunInput input(std::make_unique<TimedViews>(), "views");
    const RunRequest request{.options = test::fast_options(),
                             .folder = path("run"),
                             .overwrite = true,
                             .evidence = false,
                             .odometry = write("odometry.txt", text)};
    const RunListener listener{.on_detection = [](const Detection&) {},
                               .on_bad_frame = [](const std::string&) {}};
    const std::atomic<bool> stop{false};
    return record_run(input, request, listener, stop);
  }
};

TEST_F(RunWithOdometryTest, EachFrameHasItsOdometryAlsoAnUnreadableOne) {
  const RunOutcome outcome = run(tum_rows(3, 10.1, 0.1));
  std::vector<double> x;
  for (const Detection& detection : outcome.detections) x.push_back(x_of(detection.odometry));
  EXPECT_EQ(x, (std::vector<double>{-1, 0, 1, 2}));
  EXPECT_EQ(outcome.detections[2].status, Status::unreadable);
  EXPECT_EQ(outcome.record.odometry, path("odometry.txt"));
  EXPECT_FALSE(outcome.fault);
}

TEST_F(RunWithOdometryTest, OdometryOfAnotherTimeIsAFault) {
  const RunOutcome outcome = run(tum_rows(3, 50, 0.1));
  ASSERT_TRUE(outcome.fault);
  EXPECT_NE(std::string(outcome.fault->what()).find("no frame is within"), std::string::npos);
  EXPECT_THROW(run(tum_rows(3, 5, 0.1)), Error);
}

TEST(DetectorOdometry, BadOdometryLeavesTheDetectorAsItWas) {
  LoopDetector detector(test::fast_options());
  OdometryPose pose;
  EXPECT_EQ(detector.process(test::view(0), 1.0, pose).odometry->T_odometry_camera,
            pose.T_odometry_camera);
  pose.T_odometry_camera(0, 0) = 2;
  EXPECT_THROW(detector.process(test::view(1), 2.0, pose), Error);
  EXPECT_THROW(detector.skip(2.0, pose), Error);
  EXPECT_EQ(detector.size(), 1);
  EXPECT_FALSE(detector.process(test::view(1), 2.0).odometry);
}

}  // namespace
}  // namespace loopbit
