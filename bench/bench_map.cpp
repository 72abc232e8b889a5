// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What a map costs: see scripts/bench_map.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "loopbit/error.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/picture_jpeg.hpp"
#include "loopbit/world.hpp"

#include "measure.hpp"

namespace {

using loopbit::BinaryContent;
using loopbit::Detection;
using loopbit::Features;
using loopbit::LoopDetector;
using loopbit::LoopDetectorOptions;
using loopbit::MapReader;
using loopbit::MapWriter;
using loopbit::PlaceId;
using loopbit::SessionFrame;
using loopbit::bench::thread_ms;
using Clock = std::chrono::steady_clock;

constexpr int kOpenings = 5;
/// Features of a place of the large map, in place of 600: what is never read need not fill a disk.
constexpr std::size_t kFewFeatures = 20;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A camera's way: each content is the one before with some bits changed.
class Drift {
 public:
  const BinaryContent& next() {
    for (int change = 0; change < 40; ++change) {
      content_.rows[random_() % 64] ^= std::uint64_t{1} << (random_() % 64);
    }
    return content_;
  }

 private:
  std::mt19937_64 random_{2019};
  BinaryContent content_;
};

void make_map(const std::string& path, int places) {
  MapWriter map(path, LoopDetectorOptions{}, "made up");
  Features features;
  features.working_size_px = {640, 480};
  features.keypoints.resize(kFewFeatures);
  features.descriptors.resize(kFewFeatures);
  const auto shared = std::make_shared<const Features>(std::move(features));
  Drift drift;
  for (PlaceId frame = 0; frame < places; ++frame) {
    map.add({.frame = frame}, drift.next(), shared, cv::Mat());
  }
  map.finish();
}

/// From the file's name to a detector that can be asked, the file in the system's cache.
void bench_open(const std::string& folder, int places) {
  const std::string path = fmt::format("{}/map_{}.db", folder, places);
  make_map(path, places);
  double best_s = 1e9;
  double best_thread_s = 1e9;
  for (int i = 0; i < kOpenings; ++i) {
    const auto start = Clock::now();
    const double start_ms = thread_ms();
    const auto map = std::make_shared<MapReader>(path);
    const LoopDetector detector(map->options(), map);
    best_s = std::min(best_s, seconds_since(start));
    best_thread_s = std::min(best_thread_s, 1e-3 * (thread_ms() - start_ms));
  }
  fmt::print("open places={} s={:.3f} thread_s={:.3f} file_mb={:.0f}\n", places, best_s,
             best_thread_s, static_cast<double>(std::filesystem::file_size(path)) / 1e6);
  std::filesystem::remove(path);
}

/// A map that is all in memory: the peer of the one on disk.
class MemoryMap : public loopbit::MapStorage {
 public:
  void end_session() {
    earlier_ = contents_.size();
    ++session_;
  }

  void check_options(const loopbit::LoopDetectorOptions& /*options*/) override {}
  void for_each_earlier_place(const Visit& visit) override {
    for (std::size_t i = 0; i < earlier_; ++i) visit(origins_[i], contents_[i]);
  }
  void for_each_earlier_loop(const VisitLoop& visit) override {
    for (const auto& [query, match] : loops_) visit(query, match);
  }
  std::shared_ptr<const Features> features(PlaceId place) override {
    return features_[static_cast<std::size_t>(place)];
  }
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& /*image*/) override {
    origins_.push_back({session_, detection.frame});
    const auto loop_of = [&](const auto& loop) {
      const SessionFrame here{session_, loop.match.value_or(0)};
      return std::pair(SessionFrame{session_, loop.frame}, loop.earlier_match.value_or(here));
    };
    if (detection.status == loopbit::Status::loop) loops_.push_back(loop_of(detection));
    for (const auto& loop : detection.withdrawn_loops) std::erase(loops_, loop_of(loop));
    for (const auto& loop : detection.late_loops) loops_.push_back(loop_of(loop));
    contents_.push_back(content);
    features_.push_back(std::move(features));
  }
  void remove(PlaceId /*place*/) override {}
  void reject(const SessionFrame& /*query*/, const SessionFrame& /*match*/) override {}

 private:
  int session_ = 1;
  std::size_t earlier_ = 0;
  std::vector<SessionFrame> origins_;
  std::vector<std::pair<SessionFrame, SessionFrame>> loops_;
  std::vector<BinaryContent> contents_;
  std::vector<std::shared_ptr<const Features>> features_;
};

struct Times {
  std::vector<double> thread;
  std::vector<double> wall;

  void measure(LoopDetector& detector, const cv::Mat& image, Detection& detection) {
    const auto start = Clock::now();
    const double start_ms = thread_ms();
    detection = detector.process(image);
    thread.push_back(thread_ms() - start_ms);
    wall.push_back(1e3 * seconds_since(start));
  }
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double p99(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(0.99 * static_cast<double>(values.size() - 1))];
}

void print_times(int session, const char* map, const Times& times) {
  fmt::print(
      "frame session={} map={} mean_ms={:.3f} p99_ms={:.3f} wall_mean_ms={:.3f} "
      "wall_p99_ms={:.3f}\n",
      session, map, mean(times.thread), p99(times.thread), mean(times.wall), p99(times.wall));
}

/// Two laps of the built-in world as two sessions. Each frame is processed with all maps in turn.
bool bench_frames(const std::string& folder) {
  const loopbit::WorldOptions world_options{.frames = 400};
  const loopbit::World world(world_options);
  const std::string path = folder + "/town.db";
  const std::string path_with_images = folder + "/town_images.db";
  const auto memory = std::make_shared<MemoryMap>();
  const int lap = world_options.frames / 2;
  bool same = true;
  for (int session = 1; session <= 2; ++session) {
    const auto disk = std::make_shared<MapWriter>(path, LoopDetectorOptions{}, "town");
    const auto images = std::make_shared<MapWriter>(path_with_images, LoopDetectorOptions{}, "town",
                                                    loopbit::picture_jpeg);
    LoopDetector on_disk(LoopDetectorOptions{}, disk);
    LoopDetector with_images(LoopDetectorOptions{}, images);
    LoopDetector in_memory(LoopDetectorOptions{}, memory);
    Times disk_times;
    Times image_times;
    Times memory_times;
    for (int frame = 0; frame < lap; ++frame) {
      const cv::Mat image = world.render((session - 1) * lap + frame);
      Detection a;
      Detection b;
      Detection c;
      memory_times.measure(in_memory, image, a);
      disk_times.measure(on_disk, image, b);
      image_times.measure(with_images, image, c);
      same = same && a.status == b.status && a.score == b.score;
      same = same && a.status == c.status && a.score == c.score;
    }
    disk->finish();
    images->finish();
    memory->end_session();
    print_times(session, "memory", memory_times);
    print_times(session, "disk", disk_times);
    print_times(session, "disk_with_images", image_times);
  }
  const auto bytes_per_place = [&](const std::string& map) {
    return static_cast<double>(std::filesystem::file_size(map)) / world_options.frames;
  };
  fmt::print("size bytes_per_place={:.0f} with_images={:.0f}\n", bytes_per_place(path),
             bytes_per_place(path_with_images));
  std::filesystem::remove(path);
  std::filesystem::remove(path_with_images);
  return same;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: bench_map FOLDER [PLACES ...]\n");
    return 2;
  }
  try {
    if (!bench_frames(argv[1])) {
      fmt::print(stderr, "bench_map: the map on disk and the one in memory answer differently\n");
      return 1;
    }
    for (int i = 2; i < argc; ++i) bench_open(argv[1], std::atoi(argv[i]));
  } catch (const loopbit::Error& error) {
    fmt::print(stderr, "bench_map: {}\n", error.what());
    return 1;
  }
}
