// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What map_crash_test.py kills and asks.
//
//   map_crash write MAP     adds frames to a new session until it is killed; prints
//                           "SESSION FRAMES" whenever more frames of it are saved
//   map_crash verify MAP    prints "SESSION PLACES" for each session, or fails where a place is not
//                           what was written
#include <chrono>
#include <cstdio>
#include <map>
#include <string_view>
#include <thread>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/map_file.hpp"

#include "map_support.hpp"

namespace {

using loopbit::MapPlace;

constexpr std::chrono::microseconds kPause{200};

[[noreturn]] void write_for_ever(const std::string& path) {
  loopbit::MapWriter map(path, loopbit::test::fast_options(), "crash test",
                         loopbit::test::encode_image);
  std::int64_t told = 0;
  for (int frame = 0;; ++frame) {
    loopbit::test::add_frame(map, frame);
    std::this_thread::sleep_for(kPause);  // or the map would soon take long to verify
    const std::int64_t saved = map.saved_frames();
    if (saved == told) continue;
    told = saved;
    fmt::print("{} {}\n", map.session(), saved);
    std::fflush(stdout);
  }
}

/// True if every place is there from the first to the last, and as it was written.
bool verify(const std::string& path) {
  loopbit::MapReader map(path);
  std::map<int, int> places;
  bool all_true = true;
  map.for_each_place([&](const MapPlace& place) {
    const int frame = places[place.at.session]++;
    const auto features = map.features_of(place);
    all_true = all_true && place.at.frame == frame &&
               place.content == loopbit::test::content_of(frame) && features &&
               loopbit::test::same_features(*features, loopbit::test::few_features(frame)) &&
               map.image_of(place) == loopbit::test::image_bytes(frame);
  });
  for (const auto& [session, number] : places) fmt::print("{} {}\n", session, number);
  return all_true && map.damage().empty() && map.check_structure().empty();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    if (argv[1] == std::string_view("write")) write_for_ever(argv[2]);
    return verify(argv[2]) ? 0 : 1;
  } catch (const loopbit::Error& error) {
    fmt::print(stderr, "map_crash: {}\n", error.what());
    return 3;
  }
}
