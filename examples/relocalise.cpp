// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
//
// Relocalisation: a robot starts anywhere in a mapped area and looks up each image in the old map.
// Nothing is added to the map.
//
//   relocalise MAP INPUT    MAP as written by `loopbit run --map`, INPUT as in `loopbit run`
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <loopbit/error.hpp>
#include <loopbit/image_source.hpp>
#include <loopbit/loop_detector.hpp>
#include <loopbit/map_file.hpp>

namespace {

void run(const std::string& path, const std::string& input) {
  const auto map = std::make_shared<loopbit::MapReader>(path);
  const loopbit::LoopDetector detector(map->options(), map);
  const auto source = loopbit::open_source(input);
  std::vector<loopbit::RankedPlace> ranking;
  for (loopbit::Frame frame; source->next(frame);) {
    if (!frame.error.empty()) {
      std::cerr << frame.error << '\n';
      continue;
    }
    const loopbit::Detection found = detector.query(frame.image, std::nullopt, &ranking);
    std::cout << frame.name;
    if (found.status == loopbit::Status::loop) {
      const loopbit::RankedPlace& best = ranking.front();
      std::cout << " is frame " << best.place.frame << " of session " << best.place.session
                << ", score " << best.score << '\n';
    } else {
      std::cout << " is not recognised: " << to_string(found.status) << '\n';
    }
  }
  for (const std::string& clause : map->damage()) std::cerr << "left out: " << clause << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: relocalise MAP INPUT\n";
    return 2;
  }
  try {
    run(argv[1], argv[2]);
  } catch (const loopbit::Error& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
