// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "content_scan.hpp"

#include <algorithm>
#include <array>

#include "settings.hpp"

namespace loopbit::server {
namespace {

/// Bounds and similarities in steps of 1 / 256. Stretches of a step are looked into together, in
/// the order in which they lie in the index; few of them would be spared by a better order.
constexpr int kSteps = 256;
constexpr uint32 kNone = UINT32_MAX;
constexpr uint32 kStretches = kSegmentStretches;

/// A row that was compared with the query.
struct Found {
  double similarity;
  uint32 next;  ///< of its step
  ItemPointerData row;
};

/// Lists by step; what they link is elsewhere.
struct Steps {
  std::array<uint32, kSteps + 1> first;
};

/// Best first: stretches wait in the step of their bound, rows in that of their similarity. No row
/// of a stretch is more similar than its bound. So when all stretches of a step and of those above
/// it have been looked into, the rows of the step are known, and none of those above is missing.
struct Scan {
  MemoryContext memory;  ///< of what is below
  bool has_begun;
  const ContentQuery* query;  ///< null: all rows, in no order
  uint64 entries;
  uint32 num_stretches;
  uint32* next_stretch;  ///< of the step; a stretch waits once
  Steps coarse;          ///< stretches by coarse bounds
  Steps fine;            ///< and, of those taken from there, by finer ones
  Steps rows;
  Found* found;
  std::size_t num_found;
  std::size_t max_found;
  uint32 last;  ///< found rows without a content, which come last
  int step;     ///< the next one
  uint32* ready;
  std::size_t num_ready;
  std::size_t max_ready;
  std::size_t num_given;
};

Scan& state_of(IndexScanDesc scan) { return *static_cast<Scan*>(scan->opaque); }

/// In integers, so that the step of a bound is never below that of what it bounds.
int step_of(int overlap, int larger_count) {
  if (larger_count == 0) return 0;
  return std::min(overlap, larger_count) * kSteps / larger_count;
}

template <typename Value>
Value* allocate(const Scan& scan, std::size_t number) {
  return static_cast<Value*>(
      MemoryContextAllocHuge(scan.memory, std::max<std::size_t>(number, 1) * sizeof(Value)));
}

/// Room for one more at least.
template <typename Value>
void grow(Value*& values, std::size_t& max_values) {
  max_values *= 2;
  values = static_cast<Value*>(repalloc_huge(values, max_values * sizeof(Value)));
}

void wait_in(Steps& steps, int step, uint32 stretch, Scan& scan) {
  uint32& first = steps.first[static_cast<std::size_t>(step)];
  scan.next_stretch[stretch] = first;
  first = stretch;
}

/// Puts the stretches of a page of coarse counts into their steps. From the last to the first, so
/// that the first comes first out of each list.
void bound_coarse_page(Scan& scan, Relation index, uint32 first_stretch) {
  std::array<uint16, ContentQuery::kMaxGroups * kSegmentStretches> sums;  // NOLINT: written to next
  std::array<uint16, kSegmentGroups> largest;                             // NOLINT: likewise
  std::array<uint16, kSegmentStretches> smallest_counts;                  // NOLINT: likewise
  const ContentQuery& query = *scan.query;
  const Buffer buffer =
      read_page(index, coarse_block(first_stretch), PageKind::coarse, BUFFER_LOCK_SHARE);
  const auto& page = body<CoarsePage>(BufferGetPage(buffer));
  coarse_sums(query, page.counts[0], kSegmentGroups, sums.data(), largest.data());
  std::copy_n(page.smallest_counts, kSegmentStretches, smallest_counts.begin());
  UnlockReleaseBuffer(buffer);
  const uint32 end = std::min(kStretches, scan.num_stretches - first_stretch);
  for (uint32 i = end; i-- > 0;) {
    const uint16* of_group = &sums[i / kInterleaved * query.num_groups * kInterleaved];
    uint16 sum = 0;
    for (std::size_t group = 0; group < query.num_groups; ++group) {
      sum = std::max(sum, of_group[group * kInterleaved + i % kInterleaved]);
    }
    const int larger = std::max(query.count, smallest_counts[i]);
    wait_in(scan.coarse, step_of(sum, larger), first_stretch + i, scan);
  }
}

void bound_coarse_pages(Scan& scan, Relation index) {
  uint32 first = (scan.num_stretches - 1) / kStretches * kStretches;
  for (;; first -= kStretches) {
    CHECK_FOR_INTERRUPTS();
    bound_coarse_page(scan, index, first);
    if (first == 0) return;
  }
}

void add_found(Scan& scan, const Found& row, uint32& first) {
  if (scan.num_found == scan.max_found) grow(scan.found, scan.max_found);
  Found& added = scan.found[scan.num_found];
  added = row;
  added.next = first;
  first = static_cast<uint32>(scan.num_found++);
}

/// Compares the contents of a stretch.
void look_into(Scan& scan, Relation index, uint32 stretch) {
  CHECK_FOR_INTERRUPTS();
  const uint64 first = uint64{stretch} * kStretchContents;
  const std::size_t size = std::min<uint64>(kStretchContents, scan.entries - first);
  std::array<uint16, kStretchContents> overlaps{};
  const Buffer buffer =
      read_page(index, contents_block(stretch), PageKind::contents, BUFFER_LOCK_SHARE);
  const auto& page = body<ContentsPage>(BufferGetPage(buffer));
  if (scan.query != nullptr) max_overlaps(*scan.query, page.contents, size, overlaps.data());
  std::array<uint16, kStretchContents> counts{};
  std::array<ItemPointerData, kStretchContents> rows{};
  std::copy_n(page.counts, size, counts.begin());
  std::copy_n(page.rows, size, rows.begin());
  UnlockReleaseBuffer(buffer);
  for (std::size_t i = 0; i < size; ++i) {
    if (!ItemPointerIsValid(&rows[i])) continue;
    if (scan.query == nullptr || counts[i] == kNoContent) {
      add_found(scan, {.similarity = 0, .next = kNone, .row = rows[i]}, scan.last);
      continue;
    }
    const int larger = std::max(scan.query->count, counts[i]);
    const auto step = static_cast<std::size_t>(step_of(overlaps[i], larger));
    add_found(scan,
              {.similarity = similarity(*scan.query, overlaps[i], counts[i]),
               .next = kNone,
               .row = rows[i]},
              scan.rows.first[step]);
  }
}

/// Bounds the stretches that wait in a step by their finer counts. All that share a page are
/// bounded together.
void bound_step(Scan& scan, Relation index, int step) {
  uint32 stretch = scan.coarse.first[static_cast<std::size_t>(step)];
  while (stretch != kNone) {
    CHECK_FOR_INTERRUPTS();
    std::array<uint32, kPackedRecords> numbers;               // NOLINT: written to next
    std::array<const std::uint8_t*, kPackedRecords> records;  // NOLINT: likewise
    std::array<uint16, kPackedRecords> sums;                  // NOLINT: likewise
    std::array<uint16, kPackedRecords> larger_counts;         // NOLINT: likewise
    const BlockNumber block = packed_block(stretch);
    const Buffer buffer = read_page(index, block, PageKind::packed, BUFFER_LOCK_SHARE);
    const auto& page = body<PackedPage>(BufferGetPage(buffer));
    std::size_t size = 0;
    while (stretch != kNone && packed_block(stretch) == block) {
      const std::size_t record = stretch % kSegmentStretches % kPackedRecords;
      records[size] = page.records[record];
      larger_counts[size] = std::max(scan.query->count, page.smallest_counts[record]);
      numbers[size++] = stretch;
      stretch = scan.next_stretch[stretch];
    }
    bound_overlaps(*scan.query, records.data(), size, sums.data());
    UnlockReleaseBuffer(buffer);
    for (std::size_t i = size; i-- > 0;) {
      // Sums of maxima in small blocks may be larger than maxima of sums in large ones.
      wait_in(scan.fine, std::min(step, step_of(sums[i], larger_counts[i])), numbers[i], scan);
    }
  }
}

void take_ready(Scan& scan, uint32 first) {
  scan.num_ready = 0;
  scan.num_given = 0;
  for (; first != kNone; first = scan.found[first].next) {
    if (scan.num_ready == scan.max_ready) grow(scan.ready, scan.max_ready);
    scan.ready[scan.num_ready++] = first;
  }
  // Of equals, the row that comes first in the table.
  std::sort(scan.ready, scan.ready + scan.num_ready, [&scan](uint32 a, uint32 b) {
    const Found& x = scan.found[a];
    const Found& y = scan.found[b];
    if (x.similarity != y.similarity) return x.similarity > y.similarity;
    const auto key = [](const ItemPointerData& row) {
      return uint64{ItemPointerGetBlockNumberNoCheck(&row)} << 16U |
             ItemPointerGetOffsetNumberNoCheck(&row);
    };
    return key(x.row) < key(y.row);
  });
}

/// Finds the rows of the next step; false if there is none.
bool search_step(Scan& scan, Relation index) {
  if (scan.step < 0) return false;
  const int step = scan.step--;
  const auto at = static_cast<std::size_t>(step);
  bound_step(scan, index, step);
  for (uint32 stretch = scan.fine.first[at]; stretch != kNone;
       stretch = scan.next_stretch[stretch]) {
    look_into(scan, index, stretch);
  }
  take_ready(scan, scan.rows.first[at]);
  return true;
}

void begin_search(Scan& scan, Relation index) {
  scan.has_begun = true;
  pgstat_count_index_scan(index);
  scan.entries = num_entries(index);
  const uint64 stretches = stretches_of(scan.entries);
  scan.num_stretches = static_cast<uint32>(stretches);  // no more than blocks
  for (Steps* steps : {&scan.coarse, &scan.fine, &scan.rows}) steps->first.fill(kNone);
  scan.last = kNone;
  scan.max_found = 1024;
  scan.found = allocate<Found>(scan, scan.max_found);
  scan.max_ready = 64;
  scan.ready = allocate<uint32>(scan, scan.max_ready);
  scan.step = scan.query != nullptr && stretches > 0 ? kSteps : -1;
  if (stretches == 0) return;
  if (scan.query == nullptr) {
    for (uint32 stretch = 0; stretch < scan.num_stretches; ++stretch) {
      look_into(scan, index, stretch);
    }
    return;
  }
  scan.next_stretch = allocate<uint32>(scan, scan.num_stretches);
  bound_coarse_pages(scan, index);
}

/// The next row and, unless it has none, its similarity.
const Found* next_found(Scan& scan, Relation index) {
  while (scan.num_given == scan.num_ready) {
    if (search_step(scan, index)) continue;
    if (scan.last == kNone) return nullptr;
    take_ready(scan, scan.last);
    scan.last = kNone;
    scan.query = nullptr;
  }
  return &scan.found[scan.ready[scan.num_given++]];
}

}  // namespace

IndexScanDesc begin_scan(Relation index, int num_keys, int num_orders) {
  IndexScanDesc scan = RelationGetIndexScan(index, num_keys, num_orders);
  auto* state = static_cast<Scan*>(palloc0(sizeof(Scan)));
  state->memory =
      AllocSetContextCreate(CurrentMemoryContext, "loopbit index scan", ALLOCSET_DEFAULT_SIZES);
  scan->opaque = state;
  if (num_orders > 0) {
    const auto orders = static_cast<Size>(num_orders);
    scan->xs_orderbyvals = static_cast<Datum*>(palloc0(orders * sizeof(Datum)));
    scan->xs_orderbynulls = static_cast<bool*>(palloc0(orders * sizeof(bool)));
  }
  return scan;
}

void restart_scan(IndexScanDesc scan, ScanKey /*keys*/, int /*num_keys*/, ScanKey orders,
                  int num_orders) {
  Scan& state = state_of(scan);
  MemoryContextReset(state.memory);
  const MemoryContext memory = state.memory;
  state = {};
  state.memory = memory;
  if (num_orders == 0 || scan->numberOfOrderBys == 0) return;
  if (orders != nullptr) scan->orderByData[0] = orders[0];
  const ScanKeyData& order = scan->orderByData[0];
  if ((order.sk_flags & SK_ISNULL) != 0) return;
  auto* query = allocate<ContentQuery>(state, 1);
  prepare_or_fail(DatumGetPointer(order.sk_argument), shift_tolerance_columns(), *query);
  state.query = query;
}

bool next_row(IndexScanDesc scan, ScanDirection /*direction*/) {
  Scan& state = state_of(scan);
  if (!state.has_begun) begin_search(state, scan->indexRelation);
  const Found* row = next_found(state, scan->indexRelation);
  if (row == nullptr) return false;
  scan->xs_heaptid = row->row;
  scan->xs_recheck = false;
  if (scan->numberOfOrderBys == 0) return true;
  Oid type = FLOAT8OID;
  IndexOrderByDistance distance{.value = 1 - row->similarity, .isnull = state.query == nullptr};
  index_store_float8_orderby_distances(scan, &type, &distance, false);
  return true;
}

void end_scan(IndexScanDesc scan) { MemoryContextDelete(state_of(scan).memory); }

}  // namespace loopbit::server
