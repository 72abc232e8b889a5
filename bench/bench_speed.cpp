// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What each frame of a drive costs: see scripts/bench_speed.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "loopbit/image_source.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/world.hpp"

#include "measure.hpp"

namespace {

using loopbit::bench::thread_ms;

/// The shortest times of one frame, ms.
struct FrameTimes {
  static constexpr double kUnknown = 1e9;
  double content = kUnknown;
  double retrieval = kUnknown;
  double features = kUnknown;
  double verification = kUnknown;
  double total = kUnknown;

  void note(const loopbit::StepTimes& steps, double total_ms) {
    content = std::min(content, steps.content_ms);
    retrieval = std::min(retrieval, steps.retrieval_ms);
    features = std::min(features, steps.features_ms);
    verification = std::min(verification, steps.verification_ms);
    total = std::min(total, total_ms);
  }
};

/// Each frame is in memory before its clock starts.
void drive(loopbit::ImageSource& source, std::vector<FrameTimes>& times) {
  loopbit::LoopDetector detector;
  loopbit::Frame frame;
  for (std::size_t i = 0; source.next(frame); ++i) {
    if (times.size() <= i) times.emplace_back();
    const double start_ms = thread_ms();
    const loopbit::Detection detection = detector.process(frame.image, frame.timestamp_s);
    times[i].note(detection.times, thread_ms() - start_ms);
  }
}

/// A folder of images, or a world as FRAMES,LAPS,WIDTH,HEIGHT.
std::unique_ptr<loopbit::ImageSource> open(const std::string& input) {
  loopbit::WorldOptions world;
  const bool is_world = std::sscanf(input.c_str(), "%d,%lf,%d,%d", &world.frames, &world.laps,
                                    &world.width_px, &world.height_px) == 4;
  if (!is_world) return loopbit::open_source(input);
  return loopbit::make_world_source(std::make_shared<const loopbit::World>(world));
}

void run(int argc, char** argv) {
  if (argc < 3) {
    for (const auto set : loopbit::available_instruction_sets()) {
      fmt::print("{}\n", loopbit::to_string(set));
    }
    return;
  }
  std::vector<FrameTimes> times;
  const int repeat = std::atoi(argv[2]);
  for (int i = 0; i < repeat; ++i) drive(*open(argv[1]), times);
  for (const FrameTimes& t : times) {
    fmt::print("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", t.content, t.retrieval, t.features,
               t.verification, t.total);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return loopbit::bench::run_main("bench_speed", [&] { run(argc, argv); });
}
