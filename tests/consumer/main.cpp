// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <iostream>

#include <loopbit/loop_detector.hpp>
#include <opencv2/imgcodecs.hpp>

int main(int argc, char** argv) {
  loopbit::LoopDetector detector;
  for (int i = 1; i < argc; ++i) {
    const loopbit::Detection d = detector.process(cv::imread(argv[i]));
    if (d.status == loopbit::Status::loop) std::cout << d.frame << " is " << *d.match << '\n';
  }
}
