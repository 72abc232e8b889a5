// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Images of places in maps, and maps of the version that had none.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "loopbit/loop_detector.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_tools.hpp"

#include "map_support.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<unsigned char>;

/// How many places have an image, all of them true.
std::int64_t true_images(MapReader& map) {
  std::int64_t images = 0;
  for (const MapPlace& place : places_of(map)) {
    const auto image = map.image_of(place);
    if (!image) continue;
    EXPECT_EQ(*image, image_bytes(place.at.frame));
    ++images;
  }
  return images;
}

class MapImagesTest : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    map_path_ = path("map.db");
  }

  /// A map of version 1 with two sessions.
  [[nodiscard]] std::string old_map() const { return write("old.db", read_bytes(LOOPBIT_OLD_MAP)); }

  std::string map_path_;
};

TEST_F(MapImagesTest, AreKeptWhereAskedFor) {
  add_session(map_path_, 3, "without");
  add_session(map_path_, 40, "with", std::nullopt, encode_image);
  MapReader map(map_path_);
  EXPECT_EQ(true_images(map), 40);
  EXPECT_FALSE(map.image_of(places_of(map)[2]).has_value());
  std::int64_t bytes = 0;
  for (int frame = 0; frame < 40; ++frame) {
    bytes += static_cast<std::int64_t>(image_bytes(frame).size());
  }
  EXPECT_EQ(map.images().number, 40);
  EXPECT_EQ(map.images().bytes, bytes);
  EXPECT_TRUE(map.damage().empty());
  EXPECT_EQ(check_map(map_path_).images, 40);
}

TEST_F(MapImagesTest, AreOfWhatTheDetectorSawWhateverBecomesOfItsImage) {
  cv::Mat1b image = textured_image({1280, 720}, 1);
  const auto expected = static_cast<unsigned char>(cv::mean(image)[0]);
  std::vector<cv::Size> sizes;
  {
    const auto map = std::make_shared<MapWriter>(
        map_path_, fast_options(), "drive", [&](const cv::Mat& picture) {
          sizes.push_back(picture.size());
          return Bytes{static_cast<unsigned char>(cv::mean(picture)[0])};
        });
    LoopDetector detector(fast_options(), map);
    detector.process(image);
    image.setTo(0);
    detector.skip();
    map->finish();
  }
  EXPECT_EQ(sizes, (std::vector<cv::Size>{{320, 180}}));
  MapReader map(map_path_);
  const auto kept = map.image_of(places_of(map).at(0));
  ASSERT_TRUE(kept && kept->size() == 1);
  EXPECT_NEAR(kept->front(), expected, 2);
  EXPECT_EQ(map.images().number, 1);
}

TEST_F(MapImagesTest, WhatTheEncoderThrowsIsThrownAndWhatWasSavedIsKept) {
  MapWriter map(map_path_, fast_options(), "drive", [](const cv::Mat& image) {
    if (image.at<int>(0, 0) == 1) throw std::runtime_error("no encoder");
    return encode_image(image);
  });
  add_frame(map, 0);
  map.flush();
  add_frame(map, 1);
  EXPECT_THROW(map.flush(), std::runtime_error);
  EXPECT_EQ(places_of(map_path_).size(), 1U);
}

TEST_F(MapImagesTest, DamagedOnesAreLeftOutAndTold) {
  add_session(map_path_, 6, "drive", std::nullopt, encode_image);
  const auto expect_left = [&](const std::string& sql, std::int64_t images) {
    const std::string copy = path("copy.db");
    fs::copy_file(map_path_, copy, fs::copy_options::overwrite_existing);
    change(copy, sql);
    MapReader map(copy);
    EXPECT_EQ(true_images(map), images) << sql;
    EXPECT_EQ(places_of(map).size(), 6U) << sql;
    EXPECT_FALSE(check_map(copy).damage.empty()) << sql;
    expect_error(ErrorKind::input, {copy, "--recover"}, [&] { merge_map(path("into.db"), copy); });
  };
  expect_left("UPDATE image SET image = zeroblob(100) WHERE place = 2", 5);
  expect_left("UPDATE image SET checksum = 7 WHERE place = 2", 5);
  expect_left(
      "UPDATE image SET place = 9 WHERE place < 2; UPDATE image SET place = 1 WHERE place = 2", 4);
  expect_left("DELETE FROM image; INSERT INTO image SELECT * FROM features", 0);
}

TEST_F(MapImagesTest, OfNoPlaceAreTold) {
  add_session(map_path_, 6, "drive", std::nullopt, encode_image);
  change(map_path_, "UPDATE image SET place = 77 WHERE place = 2");
  const MapCheck check = check_map(map_path_);
  EXPECT_EQ(check.images, 5);
  ASSERT_EQ(check.damage.size(), 1U);
  EXPECT_NE(check.damage[0].find("place 77"), std::string::npos) << check.damage[0];
}

TEST_F(MapImagesTest, AreMergedRecoveredAndForgotten) {
  add_session(path("into.db"), 3, "another");
  add_session(map_path_, 5, "without");
  add_session(map_path_, 100, "with", std::nullopt, encode_image);
  merge_map(path("into.db"), map_path_);
  MapReader merged(path("into.db"));
  EXPECT_EQ(true_images(merged), 100);

  EXPECT_EQ(recover_map(map_path_, path("recovered.db")).images, 100);
  MapReader recovered(path("recovered.db"));
  EXPECT_EQ(true_images(recovered), 100);

  compact_map(map_path_, {.drop_sessions = {1}, .max_places = 50});
  EXPECT_EQ(MapReader(map_path_).images().number, 50);
  const CompactCounts counts = compact_map(map_path_, {.drop_sessions = {}, .drop_images = true});
  EXPECT_EQ(counts.places_after, 50);
  EXPECT_LT(counts.bytes_after, counts.bytes_before);
  EXPECT_EQ(MapReader(map_path_).images().number, 0);
  EXPECT_TRUE(check_map(map_path_).damage.empty());
}

TEST_F(MapImagesTest, AMapOfVersion1IsReadAsItIs) {
  const std::string file = old_map();
  const std::string before = read_bytes(file);
  MapReader map(file);
  EXPECT_EQ(places_of(map).size(), 5U);
  EXPECT_EQ(true_images(map), 0);
  EXPECT_EQ(map.images().number, 0);
  EXPECT_TRUE(check_map(file).damage.empty());
  EXPECT_EQ(read_bytes(file), before);
  EXPECT_EQ(merge_map(map_path_, file).sessions, 2);
  EXPECT_EQ(read_bytes(file), before);
}

TEST_F(MapImagesTest, AMapOfVersion1IsContinuedWithImages) {
  const std::string file = old_map();
  const auto before = places_of(file);
  {
    MapWriter map(file, MapReader(file).options(), "drive", encode_image);
    for (int frame = 0; frame < 4; ++frame) add_frame(map, frame);
  }
  MapReader map(file);
  const auto after = places_of(map);
  ASSERT_EQ(after.size(), before.size() + 4);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].id, before[i].id);
    EXPECT_EQ(after[i].content, before[i].content);
    EXPECT_TRUE(map.features_of(after[i]).has_value());
  }
  EXPECT_EQ(map.images().number, 4);
  EXPECT_EQ(map.image_of(after.back()), image_bytes(3));
  EXPECT_TRUE(check_map(file).damage.empty());
}

TEST_F(MapImagesTest, AMapOfVersion1IsRecoveredWithoutItsFirstPage) {
  // A larger one, which has other rows where images begin today.
  add_session(map_path_, 120);
  make_older(map_path_, 1);
  EXPECT_EQ(places_of(map_path_).size(), 120U);
  for (std::string bytes : {read_bytes(LOOPBIT_OLD_MAP), read_bytes(map_path_)}) {
    const auto places = static_cast<std::int64_t>(places_of(write("whole.db", bytes)).size());
    std::fill_n(bytes.begin(), 16384, '\x5a');
    fs::remove(path("recovered.db"));
    const MapCheck check = recover_map(write("damaged.db", bytes), path("recovered.db"));
    EXPECT_EQ(check.places, places);
    EXPECT_EQ(check.damage.size(), 1U);
    EXPECT_TRUE(check_map(path("recovered.db")).damage.empty());
  }
}

TEST_F(MapImagesTest, AMapOfVersion1WithAStrangeTableIsNotTouched) {
  const std::string file = old_map();
  change(file, "CREATE TABLE stranger (x)");
  const std::string before = read_bytes(file);
  expect_error(ErrorKind::input, {file, "'stranger'", "version 1"},
               [&] { const MapWriter map(file, fast_options(), "drive"); });
  EXPECT_EQ(read_bytes(file), before);
}

}  // namespace
}  // namespace loopbit::test
