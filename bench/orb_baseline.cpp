// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What a plain detector makes of the same candidates: ORB-1000, mutual matches with the ratio test,
// fundamental matrix, each frame alone. Its score is the number of inliers.
//
//   orb_baseline INPUT > loops.csv
#include <cstdio>
#include <vector>

#include <fmt/core.h>

#include "loopbit/gray_image.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector.hpp"

#include "measure.hpp"
#include "orb_matching.hpp"

namespace loopbit::bench {
namespace {

void detect(const char* input) {
  const auto source = open_source(input);
  LoopDetector detector;
  std::vector<OrbFeatures> places;
  std::vector<RankedPlace> candidates;
  fmt::print("frame,status,match,score\n");
  for (Frame frame; source->next(frame);) {
    places.push_back(orb(working_image(gray_image(frame.image))));
    static_cast<void>(detector.query(frame.image, frame.timestamp_s, &candidates));
    const Detection detection = detector.process(frame.image, frame.timestamp_s);
    int best = 0;
    int match = -1;
    for (const RankedPlace& candidate : candidates) {
      const OrbFeatures& place = places[static_cast<std::size_t>(candidate.place.frame)];
      const int found = static_cast<int>(orb_inliers(places.back(), place).size());
      if (found <= best) continue;
      best = found;
      match = candidate.place.frame;
    }
    if (match >= 0)
      fmt::print("{},loop,{},{}\n", detection.frame, match, best);
    else
      fmt::print("{},no_geometry,,0\n", detection.frame);
  }
}

}  // namespace
}  // namespace loopbit::bench

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: orb_baseline INPUT > loops.csv\n");
    return 2;
  }
  return loopbit::bench::run_main("orb_baseline", [&] { loopbit::bench::detect(argv[1]); });
}
