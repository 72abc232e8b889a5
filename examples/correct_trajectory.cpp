// A pose graph in a few lines: two laps around a square by drifting odometry, one right loop and
// one wrong one. Prints what becomes of both, and writes corrected.g2o.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "loopbit/g2o_file.hpp"
#include "loopbit/loop_graph.hpp"
#include "loopbit/odometry.hpp"

int main() {
  // 1 m ahead, and a turn to the right after 10 m. The odometry turns 0.3 degrees too far per
  // metre.
  const auto step = [](bool at_corner) {
    const double turn = (at_corner ? 90.3 : 0.3) * std::numbers::pi / 180;
    return cv::Matx44d{std::cos(turn),  0, std::sin(turn), 0, 0, 1, 0, 0,
                       -std::sin(turn), 0, std::cos(turn), 1, 0, 0, 0, 1};
  };
  const loopbit::OdometryDrift drift{.rotation_deg_per_m = 0.3};

  loopbit::LoopGraph graph;
  graph.add_keyframe();
  for (int k = 1; k <= 80; ++k) {
    const cv::Matx44d moved = step(k % 10 == 0);
    graph.add_keyframe({moved, loopbit::drift_covariance(moved, drift)});
  }

  // What a detector with a camera measures: the pose of the query in the frame of the match, here
  // exactly the same place, with a covariance of 5 cm and 0.5 degrees.
  const double rotation = 0.5 * std::numbers::pi / 180;
  const double p = 0.05 * 0.05;
  const double r = rotation * rotation;
  loopbit::LoopEdge loop{.match = 5, .query = 45};
  loop.covariance = cv::Matx66d::diag({p, p, p, r, r, r});
  graph.add_loop(loop);
  loop.query = 65;  // two places that look alike: it is 14 m away
  graph.add_loop(loop);
  graph.solve();

  for (const loopbit::JudgedLoop& judged : graph.loops()) {
    std::printf("loop %d -> %d: %s\n", judged.edge.query, judged.edge.match,
                std::string(to_string(judged.verdict)).c_str());
  }
  const cv::Matx44d last = graph.pose(80);
  std::printf("the end is %.2f m from the start\n", std::hypot(last(0, 3), last(2, 3)));
  loopbit::write_g2o("corrected.g2o", graph);
}
