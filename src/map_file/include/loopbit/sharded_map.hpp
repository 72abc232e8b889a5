// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "loopbit/map_file.hpp"
#include "loopbit/map_storage.hpp"

namespace loopbit {

/// Reads a map whose sessions are distributed over several servers: the answers are those of one
/// map with all sessions. The servers need not know each other. If all can search, contents are
/// sent to all at once, and features are read from the owners of the candidates. A server that does
/// not answer is left out from then on. Of a session that two servers have, since it is being
/// moved, one copy counts. Sees no later change. Serves the queries of one LoopDetector.
class ShardedMap final : public MapStorage, private PlaceSearch {
 public:
  /// Throws Error: the first one if no server can be asked, and kind option if two servers have
  /// different sessions of the same number.
  explicit ShardedMap(const std::vector<std::string>& addresses,
                      std::size_t cache_mb = kMapCache_mb);
  ~ShardedMap() override;
  ShardedMap(const ShardedMap&) = delete;
  ShardedMap& operator=(const ShardedMap&) = delete;
  ShardedMap(ShardedMap&&) = delete;
  ShardedMap& operator=(ShardedMap&&) = delete;

  /// See MapReader.
  [[nodiscard]] LoopDetectorOptions options() const;
  [[nodiscard]] std::string path() const;
  [[nodiscard]] std::vector<std::string> damage() const;

  /// The servers that are left out, without passwords.
  [[nodiscard]] std::vector<std::string> not_asked() const;

  /// Why, one sentence each, since the last call.
  std::vector<std::string> take_notices();

  void check_options(const LoopDetectorOptions& options) override;
  PlaceSearch* place_search() override;
  void for_each_earlier_place(const MapStorage::Visit& visit) override;
  void for_each_earlier_loop(const VisitLoop& visit) override;
  /// Empty if they are lost, or on a server that is left out.
  std::shared_ptr<const Features> features(PlaceId place) override;
  /// The three throw Error (kind option).
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) override;
  void remove(PlaceId place) override;
  void reject(const SessionFrame& query, const SessionFrame& match) override;

 private:
  struct Shard {
    std::string shown;                  ///< its address
    std::unique_ptr<MapReader> reader;  ///< null if it is left out
    std::vector<PlaceId> places = {};   ///< the numbers of its places, by its own;
                                        ///< kCopy: another shard's copy counts
  };

  /// Where a place is.
  struct Origin {
    std::uint32_t shard = 0;
    PlaceId place = 0;  ///< by the number that the shard gives it
  };

  template <typename Known>
  struct Found;

  static constexpr PlaceId kCopy = -1;

  void for_each_place(double unmoved, const PlaceSearch::Visit& visit) override;
  Similar most_similar(const BinaryContent& content, int shift_tolerance_columns,
                       std::size_t number) override;
  BinaryContent content(PlaceId place) override;

  /// Begins a snapshot of each shard. Together, they have all sessions.
  void begin();
  /// Whether another shard's copy of the session counts.
  [[nodiscard]] bool is_copy(std::uint32_t shard, int session) const;
  [[noreturn]] void refuse_change() const;
  [[nodiscard]] BinaryContent content(const Origin& origin);
  /// Leaves a shard out for which `work` fails, and returns whether it did not.
  template <typename Work>
  bool ask(Shard& shard, const Work& work);
  /// What `read(reader, add)` adds of each shard, in the order of one map; numbers the places.
  template <typename Known, typename Read>
  std::vector<Found<Known>> gather(const Read& read);

  std::vector<Shard> shards_;
  std::map<int, std::size_t> owners_;  ///< by session; without those that no description names
  std::vector<Origin> places_;
  std::vector<std::string> notices_;
};

}  // namespace loopbit
