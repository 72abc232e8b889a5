// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/picture_jpeg.hpp"
#include "loopbit/sharded_map.hpp"

namespace loopbit::python {

/// A map that several Python threads and one detector may share. It serves one at a time. Call all
/// functions but the constructor and path() without the GIL; see SharedDetector.
class SharedMap : public MapStorage, private PlaceSearch {
 public:
  using Visit = MapStorage::Visit;

  /// `path`: without secrets.
  explicit SharedMap(std::string path) : path_(std::move(path)) {}

  [[nodiscard]] const std::string& path() const { return path_; }

  /// The options that a detector of the map needs; none if the map has no options.
  [[nodiscard]] virtual std::optional<LoopDetectorOptions> options() const = 0;

  void check_options(const LoopDetectorOptions& options) final;
  PlaceSearch* place_search() final;
  void for_each_earlier_place(const Visit& visit) final;
  void for_each_earlier_loop(const VisitLoop& visit) final;
  std::int64_t epoch() final;
  MapNews news() final;
  std::shared_ptr<const Features> features(PlaceId place) final;
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) final;
  void remove(PlaceId place) final;
  void reject(const SessionFrame& query, const SessionFrame& match) final;

 protected:
  [[nodiscard]] std::scoped_lock<std::mutex> lock() const {
    check_process();  // first: in a forked child a thread of the parent may hold the mutex for ever
    return std::scoped_lock(mutex_);
  }

 private:
  void for_each_place(double unmoved, const PlaceSearch::Visit& visit) final;
  Similar most_similar(const BinaryContent& content, int shift_tolerance_columns,
                       std::size_t number) final;
  BinaryContent content(PlaceId place) final;

  virtual void check_process() const {}
  [[nodiscard]] virtual MapStorage& storage() = 0;

  std::string path_;
  mutable std::mutex mutex_;
};

/// One that is a Map of the library.
template <typename Map>
class SharedAs : public SharedMap {
 public:
  /// Calls use(map) exclusively and returns its result.
  template <typename Use>
  auto exclusively(Use&& use) {
    const auto guard = lock();
    return use(map_);
  }

 protected:
  /// `arguments`: of the Map's constructor.
  template <typename... Arguments>
  explicit SharedAs(const std::string& path, Arguments&&... arguments)
      : SharedMap(without_secrets(path)), map_(std::forward<Arguments>(arguments)...) {}

  Map map_;

 private:
  [[nodiscard]] MapStorage& storage() override { return map_; }
};

class SharedReader : public SharedAs<MapReader> {
 public:
  SharedReader(const std::filesystem::path& path, std::size_t cache_mb)
      : SharedAs(path.string(), path.string(), cache_mb) {}

  [[nodiscard]] std::optional<LoopDetectorOptions> options() const override;
};

class SharedShards : public SharedAs<ShardedMap> {
 public:
  SharedShards(const std::vector<std::string>& addresses, std::size_t cache_mb)
      : SharedAs(fmt::format("{}", fmt::join(addresses, " ")), addresses, cache_mb) {}

  [[nodiscard]] std::optional<LoopDetectorOptions> options() const override;
};

class SharedWriter : public SharedAs<MapWriter> {
 public:
  SharedWriter(const std::filesystem::path& path, const LoopDetectorOptions& options,
               const std::string& name, bool keep_images, std::size_t cache_mb,
               const std::optional<std::filesystem::path>& queue)
      : SharedAs(path.string(), path.string(), options, name,
                 keep_images ? picture_jpeg : EncodeImage{}, cache_mb),
        options_(options) {
    if (queue) map_.set_queue(queue->string());
  }

  [[nodiscard]] std::optional<LoopDetectorOptions> options() const override { return options_; }

 private:
  void check_process() const override { map_.check_process(); }

  LoopDetectorOptions options_;
};

}  // namespace loopbit::python
