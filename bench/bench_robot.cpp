// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A robot of a fleet, whose camera gives frames at a steady rate: see scripts/bench_fleet.
#include <chrono>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>
#include <fmt/os.h>

#include "loopbit/binary_content.hpp"
#include "loopbit/fleet_map.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"

#include "measure.hpp"

namespace {

using namespace loopbit;  // NOLINT(google-build-using-namespace)
using Seconds = std::chrono::duration<double>;

/// What a detector makes of an image.
struct View {
  BinaryContent content;
  std::shared_ptr<const Features> features;
};

/// Those of a map, from number `first` on.
std::vector<View> views_of(const std::string& map_path, std::size_t first) {
  MapReader map(map_path);
  std::vector<MapPlace> places;
  map.for_each_place([&](const MapPlace& place) { places.push_back(place); });
  std::vector<View> views;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const MapPlace& place = places[(first + i) % places.size()];
    views.push_back(
        {place.content, std::make_shared<const Features>(map.features_of(place).value())});
  }
  return views;
}

/// Of the system's monotonic clock, which all robots share.
double now_s() { return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Does with a map what a LoopDetector does for each frame, but neither extracts nor compares
/// features: that takes the processors of as many robots.
class Robot {
 public:
  explicit Robot(const std::string& address, const std::string& queue)
      : map_(address, {}, "bench_robot") {
    map_.set_queue(queue);
    map_.for_each_earlier_place([](const SessionFrame&, const BinaryContent&) {
      throw std::runtime_error("the map is not empty");
    });
    map_.for_each_earlier_loop([](const SessionFrame&, const SessionFrame&) {});
  }

  struct Processed {
    std::int64_t epoch;  ///< as of which it knows the map
    double retrieval_s;  ///< among the places of others
  };

  Processed process(const View& view) {
    const MapNews news = map_.news();
    for (const auto& [at, content] : news.places) others_.add(content);
    const PlaceId frame = own_.size();
    (void)own_.query(view.content, frame);
    const double begin_s = now_s();
    const auto similar = others_.query(view.content, others_.size());
    const double retrieval_s = now_s() - begin_s;
    if (!similar.empty()) (void)map_.features(-1 - similar.front().place);
    own_.add(view.content);
    map_.add({.frame = frame, .status = Status::low_score}, view.content, view.features, {});
    return {.epoch = news.epoch, .retrieval_s = retrieval_s};
  }

  void finish() {
    map_.finish();
    if (!map_.queue().empty()) throw std::runtime_error("frames are left in " + map_.queue());
  }

  [[nodiscard]] int session() const { return map_.session(); }

 private:
  MapWriter map_;
  PlaceIndex own_;
  PlaceIndex others_;  ///< place i is the map's -1 - i
};

/// A frame arrives when the camera gives it, even if the robot is still busy with those before.
void run(const std::vector<std::string>& arguments) {
  if (arguments.size() != 7) {
    throw std::runtime_error("usage: bench_robot VIEWS FIRST_VIEW MAP BEGIN_S FRAMES RATE_HZ OUT");
  }
  const std::vector<View> views = views_of(arguments[0], std::stoul(arguments[1]));
  const double begin_s = std::stod(arguments[3]);
  const std::size_t frames = std::stoul(arguments[4]);
  const double rate_hz = std::stod(arguments[5]);
  const std::string& out_path = arguments[6];
  use_fleet_maps();
  Robot robot(arguments[2], out_path + ".queue.db");
  if (now_s() > begin_s) throw std::runtime_error("the robot was not ready in time");
  auto out = fmt::output_file(out_path);
  out.print("session,frame,arrival_s,start_s,done_s,retrieval_s,epoch\n");
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double arrival_s = begin_s + static_cast<double>(frame) / rate_hz;
    std::this_thread::sleep_for(Seconds(arrival_s - now_s()));
    const double start_s = now_s();
    const Robot::Processed processed = robot.process(views[frame % views.size()]);
    out.print("{},{},{:.6f},{:.6f},{:.6f},{:.6f},{}\n", robot.session(), frame, arrival_s, start_s,
              now_s(), processed.retrieval_s, processed.epoch);
  }
  robot.finish();
}

}  // namespace

int main(int argc, char** argv) {
  return loopbit::bench::run_main("bench_robot", [&] { run({argv + 1, argv + argc}); });
}
