// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "searched_places.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "row_values.hpp"

namespace loopbit {
namespace {

/// 50 bytes each.
constexpr int kFetchedAtOnce = 16'384;

}  // namespace

SearchedPlaces::SearchedPlaces(const MapDatabase& database, StoredFeatures& stored, Damage& damage)
    : database_(database), stored_(stored), damage_(damage) {}

void SearchedPlaces::for_each_place(double unmoved, const Visit& visit) {
  stored_.begin(database_.path());
  const auto snapshot = database_.snapshot();
  database_
      .prepare(fmt::format(
          "DECLARE searched_places CURSOR FOR SELECT place, session, frame, "
          "changes_view(content::binary_content, {}, checksum = place_checksum(session, frame, "
          "timestamp, content::binary_content)) OVER (ORDER BY place) FROM place WHERE place > 0",
          unmoved))
      ->step();
  const auto rows = database_.prepare(fmt::format("FETCH {} FROM searched_places", kFetchedAtOnce));
  for (;;) {
    rows->reset();
    int number = 0;
    for (; rows->step(); ++number) {
      const std::int64_t key = rows->integer(0);
      if (rows->is_null(3)) {
        damage_.add(fmt::format("place {}: its content differs from its checksum", key));
        continue;
      }
      const SessionFrame at{static_cast<int>(rows->integer(1)), static_cast<int>(rows->integer(2))};
      keys_.push_back(key);
      stored_.add(key, at);
      visit(at, rows->integer(3) != 0);
    }
    if (number < kFetchedAtOnce) break;
  }
  snapshot->end();
}

PlaceSearch::Similar SearchedPlaces::most_similar(const BinaryContent& content,
                                                  int shift_tolerance_columns, std::size_t number) {
  set_tolerance(shift_tolerance_columns);
  if (!most_similar_) {
    most_similar_ = database_.prepare(
        "SELECT place, similarity(?1, content::binary_content, ?2::bigint::integer) FROM place "
        "ORDER BY content::binary_content <~> ?1 FETCH FIRST (?3) ROWS WITH TIES");
  }
  SqlStatement& rows = *most_similar_;
  rows.reset();
  rows.bind(1, content_bytes(content));
  rows.bind(2, std::int64_t{shift_tolerance_columns});
  rows.bind(3, static_cast<std::int64_t>(number));
  Similar similar;
  std::size_t found = 0;
  for (; rows.step(); ++found) {
    const auto key = std::ranges::lower_bound(keys_, rows.integer(0));
    if (key == keys_.end() || *key != rows.integer(0)) continue;  // damaged, or new
    similar.places.push_back({static_cast<PlaceId>(key - keys_.begin()), rows.real(1)});
  }
  similar.is_all = found < number;
  std::ranges::sort(similar.places, &Candidate::comes_before);
  return similar;
}

BinaryContent SearchedPlaces::content(PlaceId place) {
  if (!content_) content_ = database_.prepare("SELECT content FROM place WHERE place = ?1");
  content_->reset();
  content_->bind(1, keys_.at(static_cast<std::size_t>(place)));
  BinaryContent content;
  if (content_->step()) read_content(content_->bytes(0), content);  // or it was removed since
  return content;
}

void SearchedPlaces::set_tolerance(int columns) {
  if (columns == tolerance_columns_) return;
  const auto set =
      database_.prepare("SELECT set_config('loopbit.shift_tolerance_columns', ?1, false)");
  const std::string value = std::to_string(columns);
  set->bind(1, std::string_view(value));
  set->step();
  tolerance_columns_ = columns;
}

}  // namespace loopbit
