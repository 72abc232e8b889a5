// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "loopbit/map_database.hpp"
#include "loopbit/map_storage.hpp"

#include "map_rows.hpp"
#include "stored_features.hpp"

namespace loopbit {

/// Searches a map in its database; see MapDatabase::has_search(). Holds 8 bytes per place. Finds no
/// place that was added after for_each_place().
class SearchedPlaces final : public PlaceSearch {
 public:
  /// Keeps the references. `stored` learns of the places; see StoredFeatures::begin().
  SearchedPlaces(const MapDatabase& database, StoredFeatures& stored, Damage& damage);

  void for_each_place(double unmoved, const Visit& visit) override;
  Similar most_similar(const BinaryContent& content, int shift_tolerance_columns,
                       std::size_t number) override;
  BinaryContent content(PlaceId place) override;

 private:
  void set_tolerance(int columns);

  const MapDatabase& database_;
  StoredFeatures& stored_;
  Damage& damage_;
  std::vector<std::int64_t> keys_;  ///< of the rows, by place
  int tolerance_columns_ = -1;      ///< of the connection; -1 = not set
  std::unique_ptr<SqlStatement> most_similar_;
  std::unique_ptr<SqlStatement> content_;
};

}  // namespace loopbit
