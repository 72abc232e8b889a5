// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A map is written by two threads, the detector's and its own, while others read the file. For the
// thread sanitizer; links the detector only, so that it is built quickly.
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "loopbit/loop_detector.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/read_ahead.hpp"

#include "batch_writer.hpp"
#include "file_database.hpp"
#include "map_schema.hpp"
#include "map_support.hpp"
#include "server_features.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

/// One pixel of the image: all that is needed to tell it.
std::vector<unsigned char> first_pixel(const cv::Mat& image) { return {image.at<uchar>(0, 0)}; }

/// Reads the whole map again and again; every place that was saved must be there, whole.
void read_until(const std::atomic<bool>& is_done, const std::string& path, const MapWriter& writer,
                std::size_t earlier_places) {
  do {
    const auto saved = static_cast<std::size_t>(writer.saved_frames());
    MapReader map(path);
    std::size_t places = 0;
    map.for_each_place([&](const MapPlace& place) {
      ++places;
      EXPECT_TRUE(map.features_of(place).has_value());
      EXPECT_TRUE(map.image_of(place).has_value());
    });
    EXPECT_GE(places, earlier_places + saved);
    EXPECT_TRUE(map.damage().empty());
    EXPECT_EQ(check_map(path).damage, std::vector<std::string>{});
  } while (!is_done);
}

class MapThreads : public ScratchTest {};

TEST_F(MapThreads, ADetectorAddsWhileReadersReadTheFile) {
  constexpr int kScenes = 12;
  constexpr std::size_t kReaders = 2;
  const std::string map_path = path("map.db");
  const auto drive = [](LoopDetector& detector, MapWriter& map) {
    int loops = 0;
    for (int scene = 0; scene < kScenes; ++scene) {
      loops += detector.process(view(scene)).status == Status::loop;
      if (scene % 5 == 4) map.flush();
    }
    return loops;
  };
  {
    const auto map = std::make_shared<MapWriter>(map_path, fast_options(), "first", first_pixel);
    LoopDetector detector(fast_options(), map);
    drive(detector, *map);
    map->finish();
  }
  const auto map = std::make_shared<MapWriter>(map_path, fast_options(), "second", first_pixel);
  LoopDetector detector(fast_options(), map);
  std::atomic<bool> is_done = false;
  std::vector<std::thread> readers;
  readers.reserve(kReaders);
  for (std::size_t i = 0; i < kReaders; ++i) {
    readers.emplace_back([&] { read_until(is_done, map_path, *map, kScenes); });
  }
  EXPECT_GT(drive(detector, *map), kScenes / 2);
  map->finish();
  is_done = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(places_of(map_path).size(), std::size_t{2} * kScenes);
}

/// All threads ask a detector about the same scenes; each must get the answers that one gets.
void expect_same_answers_in_threads(const LoopDetector& detector) {
  constexpr std::size_t kScenes = 3;
  constexpr std::size_t kThreads = 3;
  struct Answer {
    Detection detection;
    std::vector<RankedPlace> ranking;
    Evidence evidence;
  };
  const auto ask = [&] {
    std::vector<Answer> answers(kScenes);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      Answer& answer = answers[i];
      const cv::Mat1b image = view(static_cast<int>(i) + 1, {6, 2});
      answer.detection = detector.query(image, std::nullopt, &answer.ranking, &answer.evidence,
                                        [](const SessionFrame& place) { return place.frame != 2; });
    }
    return answers;
  };
  const std::vector<Answer> expected = ask();
  EXPECT_EQ(expected[0].detection.status, Status::loop);
  EXPECT_NE(expected[1].detection.status, Status::loop);
  std::vector<std::vector<Answer>> found(kThreads);
  std::vector<std::thread> threads;
  threads.reserve(kThreads);
  for (auto& answers : found) threads.emplace_back([&] { answers = ask(); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& answers : found) {
    for (std::size_t i = 0; i < answers.size(); ++i) {
      EXPECT_EQ(answers[i].detection.status, expected[i].detection.status) << i;
      EXPECT_EQ(answers[i].detection.match, expected[i].detection.match) << i;
      EXPECT_EQ(answers[i].detection.earlier_match, expected[i].detection.earlier_match) << i;
      EXPECT_EQ(answers[i].detection.score, expected[i].detection.score) << i;
      EXPECT_EQ(answers[i].evidence.inliers, expected[i].evidence.inliers) << i;
      EXPECT_EQ(answers[i].ranking.size(), expected[i].ranking.size()) << i;
    }
  }
}

TEST_F(MapThreads, SeveralThreadsQueryOneDetector) {
  constexpr int kScenes = 16;
  {
    const auto map = std::make_shared<MapWriter>(path("map.db"), fast_options(), "drive");
    LoopDetector detector(fast_options(), map);
    for (int scene = 0; scene < kScenes; ++scene) detector.process(view(scene));
    detector.remove({0, kScenes - 1});
    expect_same_answers_in_threads(detector);
    map->finish();
  }
  // A small cache, so that features are read again and again.
  const auto map = std::make_shared<MapReader>(path("map.db"), 0);
  expect_same_answers_in_threads(LoopDetector(fast_options(), map));
}

TEST_F(MapThreads, PendingFeaturesAreGivenWhileTheyAreCommitted) {
  constexpr int kFrames = 400;
  const std::string map_path = path("map.db");
  loopbit::MapSession session;
  session.session = 1;
  BatchWriter writer(std::make_unique<FileDatabase>(open_map_for_writing(map_path)),
                     std::move(session), 1, {}, {});
  std::vector<std::shared_ptr<const Features>> added;
  int pending = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    added.push_back(std::make_shared<const Features>(few_features(frame)));
    writer.add(
        {.content = content_of(frame), .detection = {.frame = frame}, .features = added.back()});
    const int earlier = frame - frame % 20;
    if (const auto found = writer.pending(earlier)) {
      ++pending;
      ASSERT_EQ(found, added[static_cast<std::size_t>(earlier)]);
    } else {
      ASSERT_GT(writer.saved_frames(), earlier);
    }
  }
  writer.flush();
  EXPECT_GT(pending, 0);
  EXPECT_EQ(writer.pending(kFrames - 1), nullptr);
  EXPECT_EQ(writer.saved_frames(), kFrames);
  EXPECT_EQ(places_of(map_path).size(), std::size_t{kFrames});
}

/// A map with so many frames, whose keys are 1, 2 and so on.
void write_frames(const std::string& map_path, int frames) {
  loopbit::MapSession session;
  session.session = 1;
  BatchWriter writer(nullptr, std::move(session), 1, {}, {}, {.path = map_path});
  for (int frame = 0; frame < frames; ++frame) {
    writer.add({.content = content_of(frame),
                .detection = {.frame = frame},
                .features = std::make_shared<const Features>(few_features(frame))});
  }
  writer.flush();
  writer.close();
}

std::unique_ptr<MapDatabase> map_without_features(const std::string& path) {
  write_frames(path, 1);
  change(path, "DELETE FROM features");
  return open_map(path, MapDatabase::Access::read);
}

TEST_F(MapThreads, FeaturesAlongAPathAreReadAheadOnce) {
  constexpr int kFrames = 40;
  constexpr std::chrono::seconds kMost{60};
  const std::string map_path = path("map.db");
  write_frames(map_path, kFrames);
  const auto other_map = map_without_features(path("without.db"));
  Damage damage;
  std::unique_ptr<ServerFeatures> ahead;
  const auto begin = [&] {
    ahead =
        std::make_unique<ServerFeatures>(open_map(map_path, MapDatabase::Access::read), *other_map);
  };
  const auto is_ahead = [&](std::int64_t place) {
    const auto features = ahead->take(place, {}, kMost, damage);
    if (features->keypoints.empty()) return false;
    EXPECT_EQ(features->descriptors, few_features(static_cast<int>(place) - 1).descriptors);
    return true;
  };
  for (const int step : {1, -1, 2}) {
    begin();
    int place = step > 0 ? 1 : kFrames;
    EXPECT_FALSE(is_ahead(place));
    EXPECT_FALSE(is_ahead(place += step));
    while ((place += step) > 0 && place <= kFrames) EXPECT_TRUE(is_ahead(place)) << place;
    EXPECT_FALSE(is_ahead(place));  // there is none
  }
  begin();
  for (const int place : {18, 27, 21, 30, 24, 22}) EXPECT_FALSE(is_ahead(place)) << "no path";
  begin();
  for (const int place : {6, 1, 2}) EXPECT_FALSE(is_ahead(place));
  for (const int place : {3, 4, 5}) EXPECT_TRUE(is_ahead(place));
  for (const int place : {6, 4, 2, 1}) EXPECT_FALSE(is_ahead(place)) << "the caller has it";
}

TEST_F(MapThreads, NothingIsReadAheadWhileTheMapCannotBeRead) {
  constexpr std::chrono::seconds kMost{60};
  const std::string map_path = path("map.db");
  write_frames(map_path, 40);
  const auto other_map = map_without_features(path("without.db"));
  Damage damage;
  ServerFeatures ahead(open_map(map_path, MapDatabase::Access::read), *other_map);
  const auto is_ahead = [&](std::int64_t place) {
    return !ahead.take(place, {}, kMost, damage)->keypoints.empty();
  };
  change(map_path, "ALTER TABLE features RENAME TO lost_features");
  const auto begin = std::chrono::steady_clock::now();
  for (int place = 1; place <= 20; ++place) EXPECT_FALSE(is_ahead(place)) << place;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kMost);
  change(map_path, "ALTER TABLE lost_features RENAME TO features");
  bool is_back = false;
  for (int place = 21; !is_back && place <= 40; ++place) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    is_back = is_ahead(place);
  }
  EXPECT_TRUE(is_back);
}

TEST(PreparedImages, ComeFromAThreadBesideTheDetector) {
  constexpr int kScenes = 12;
  LoopDetector alone;
  LoopDetector detector;
  int scene = 0;
  ReadAhead<PreparedImage> images(
      [&](PreparedImage& image) {
        if (scene == 2 * kScenes) return false;
        image = detector.prepare(view(scene++ % kScenes));
        return true;
      },
      2);
  PreparedImage image;
  for (int i = 0; images.next(image); ++i) {
    const Detection expected = alone.process(view(i % kScenes));
    const Detection found = detector.process(std::move(image));
    EXPECT_EQ(found.status, expected.status) << i;
    EXPECT_EQ(found.match, expected.match) << i;
    EXPECT_EQ(found.score, expected.score) << i;
  }
  EXPECT_TRUE(images.is_at_end());
  EXPECT_EQ(detector.size(), 2 * kScenes);
}

}  // namespace
}  // namespace loopbit::test
