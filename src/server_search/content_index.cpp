// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The access method "loopbit": an index of contents; see docs/fleet.md.
#include <algorithm>

#include "content_pages.hpp"
#include "content_scan.hpp"
#include "postgres.hpp"

namespace loopbit::server {
namespace {

/// Appends a finished page to the index.
void append_page(Relation index, const char* page) {
  const Buffer buffer = ReadBuffer(index, P_NEW);
  LockBuffer(buffer, BUFFER_LOCK_EXCLUSIVE);
  GenericXLogState* log = GenericXLogStart(index);
  memcpy(GenericXLogRegisterBuffer(log, buffer, GENERIC_XLOG_FULL_IMAGE), page, BLCKSZ);
  GenericXLogFinish(log);
  UnlockReleaseBuffer(buffer);
}

/// An index that is built from a table, one segment after the other.
struct Build {
  Relation index;
  uint64 entries;
  char* segment;  ///< its pages
};

Page page_of(const Build& build, std::size_t number) { return build.segment + number * BLCKSZ; }

void begin_segment(const Build& build) {
  init_page(page_of(build, 0), PageKind::coarse);
  for (std::size_t i = 0; i < kPackedPages; ++i) {
    init_page(page_of(build, 1 + i), PageKind::packed);
  }
  for (std::size_t i = kFirstContentPage; i < kSegmentPages; ++i) {
    init_page(page_of(build, i), PageKind::contents);
  }
}

void end_segment(const Build& build) {
  const uint64 stretches = (stretches_of(build.entries) - 1) % kSegmentStretches + 1;
  for (std::size_t i = 0; i < kFirstContentPage + stretches; ++i) {
    append_page(build.index, page_of(build, i));
  }
}

// NOLINTNEXTLINE(readability-non-const-parameter): as PostgreSQL has it
void add_row(Relation /*index*/, ItemPointer row, Datum* values, bool* is_null, bool /*is_alive*/,
             void* state) {
  auto& build = *static_cast<Build*>(state);
  const uint64 stretch = build.entries / kStretchContents % kSegmentStretches;
  if (build.entries % (kStretchContents * kSegmentStretches) == 0) {
    if (build.entries > 0) end_segment(build);
    begin_segment(build);
  }
  put_entry({.coarse = page_of(build, 0),
             .packed = page_of(build, 1 + stretch / kPackedRecords),
             .contents = page_of(build, kFirstContentPage + stretch)},
            build.entries, is_null[0] ? nullptr : DatumGetPointer(values[0]), *row);
  ++build.entries;
}

void set_num_entries(Relation index, uint64 entries) {
  const Buffer buffer = read_page(index, 0, PageKind::index, BUFFER_LOCK_EXCLUSIVE);
  GenericXLogState* log = GenericXLogStart(index);
  body<IndexPage>(GenericXLogRegisterBuffer(log, buffer, 0)).entries = entries;
  GenericXLogFinish(log);
  UnlockReleaseBuffer(buffer);
}

IndexBuildResult* build_index(Relation table, Relation index, IndexInfo* info) {
  Build build{
      .index = index, .entries = 0, .segment = static_cast<char*>(palloc(kSegmentPages * BLCKSZ))};
  PGAlignedBlock first;
  init_page(first.data, PageKind::index);
  append_page(index, first.data);
  // In the order of the table from its start, because neighbours there look alike.
  constexpr bool kMayStartAnywhere = false;
  constexpr bool kReportProgress = true;
  const double rows = table_index_build_scan(table, index, info, kMayStartAnywhere, kReportProgress,
                                             add_row, &build, nullptr);
  if (build.entries > 0) end_segment(build);
  set_num_entries(index, build.entries);
  pfree(build.segment);
  auto* result = static_cast<IndexBuildResult*>(palloc(sizeof(IndexBuildResult)));
  result->heap_tuples = rows;
  result->index_tuples = static_cast<double>(build.entries);
  return result;
}

/// What an index of an unlogged table is after a crash. It is on disk, and logged, at once.
void build_empty_index(Relation index) {
  PGAlignedBlock first;
  init_page(first.data, PageKind::index);
  PageSetChecksumInplace(first.data, 0);
  SMgrRelation files = RelationGetSmgr(index);
  smgrwrite(files, INIT_FORKNUM, 0, first.data, true);
  log_newpage(&files->smgr_rnode.node, INIT_FORKNUM, 0, first.data, true);
  smgrimmedsync(files, INIT_FORKNUM);
}

// NOLINTNEXTLINE(readability-non-const-parameter,readability-function-size): as PostgreSQL has it
bool insert(Relation index, Datum* values, bool* is_null, ItemPointer row, Relation /*table*/,
            IndexUniqueCheck /*unique*/, bool /*is_unchanged*/, IndexInfo* /*info*/) {
  add_entry(index, is_null[0] ? nullptr : DatumGetPointer(values[0]), *row);
  return false;
}

/// Forgets the rows of a page that are dead. Returns how many are left.
uint32 clean_page(IndexVacuumInfo* info, BlockNumber block, std::size_t entries,
                  IndexBulkDeleteCallback is_dead, void* state) {
  const Buffer buffer =
      read_page(info->index, block, PageKind::contents, BUFFER_LOCK_EXCLUSIVE, info->strategy);
  GenericXLogState* log = GenericXLogStart(info->index);
  auto& page = body<ContentsPage>(GenericXLogRegisterBuffer(log, buffer, 0));
  uint32 left = 0;
  bool has_changed = false;
  for (std::size_t i = 0; i < entries; ++i) {
    ItemPointerData& row = page.rows[i];
    if (!ItemPointerIsValid(&row)) continue;
    if (is_dead(&row, state)) {
      ItemPointerSetInvalid(&row);
      has_changed = true;
    } else {
      ++left;
    }
  }
  if (has_changed) {
    GenericXLogFinish(log);
  } else {
    GenericXLogAbort(log);
  }
  UnlockReleaseBuffer(buffer);
  return left;
}

IndexBulkDeleteResult* new_vacuum_result() {
  return static_cast<IndexBulkDeleteResult*>(palloc0(sizeof(IndexBulkDeleteResult)));
}

IndexBulkDeleteResult* delete_dead(IndexVacuumInfo* info, IndexBulkDeleteResult* stats,
                                   IndexBulkDeleteCallback is_dead, void* state) {
  if (stats == nullptr) stats = new_vacuum_result();
  const uint64 entries = num_entries(info->index);
  struct Counted {
    IndexBulkDeleteCallback is_dead;
    void* state;
    double removed;
  } counted{is_dead, state, 0};
  stats->num_index_tuples = 0;
  for (uint64 first = 0; first < entries; first += kStretchContents) {
    vacuum_delay_point();
    const std::size_t size = std::min<uint64>(kStretchContents, entries - first);
    stats->num_index_tuples += clean_page(
        info, contents_block(first / kStretchContents), size,
        [](ItemPointer row, void* passed) {
          auto& of_page = *static_cast<Counted*>(passed);
          const bool dead = of_page.is_dead(row, of_page.state);
          of_page.removed += dead ? 1 : 0;
          return dead;
        },
        &counted);
  }
  stats->tuples_removed += counted.removed;
  stats->estimated_count = false;
  return stats;
}

IndexBulkDeleteResult* end_vacuum(IndexVacuumInfo* info, IndexBulkDeleteResult* stats) {
  if (info->analyze_only) return stats;
  if (stats == nullptr) {
    stats = new_vacuum_result();
    stats->num_index_tuples = static_cast<double>(num_entries(info->index));
    stats->estimated_count = true;
  }
  stats->num_pages = RelationGetNumberOfBlocks(info->index);
  return stats;
}

/// Before the first row, all coarse bounds are read and computed. The rest grows with the rows that
/// are asked for.
// NOLINTNEXTLINE(readability-function-size): as PostgreSQL has it
void estimate_cost(PlannerInfo* root, IndexPath* path, double loops, Cost* startup, Cost* total,
                   Selectivity* selectivity, double* correlation, double* pages) {
  GenericCosts costs{};
  costs.numIndexTuples = path->indexinfo->tuples;
  genericcostestimate(root, path, loops, &costs);
  const double segments = path->indexinfo->tuples / (kSegmentStretches * kStretchContents);
  *startup = costs.indexStartupCost + segments * seq_page_cost +
             segments * kSegmentStretches * cpu_operator_cost;
  *total = costs.indexTotalCost + *startup;
  *selectivity = costs.indexSelectivity;
  *correlation = costs.indexCorrelation;
  *pages = costs.numIndexPages;
}

bytea* parse_options(Datum options, bool validate) {
  static relopt_kind kind;
  if (kind == 0) kind = add_reloption_kind();
  return static_cast<bytea*>(build_reloptions(options, validate, kind, 0, nullptr, 0));
}

/// Whether an operator class has <~> as its only operator, and no functions.
bool validate_class(Oid operator_class) {
  HeapTuple row = SearchSysCache1(CLAOID, ObjectIdGetDatum(operator_class));
  if (!HeapTupleIsValid(row)) elog(ERROR, "there is no operator class %u", operator_class);
  const Oid family = reinterpret_cast<Form_pg_opclass>(GETSTRUCT(row))->opcfamily;
  ReleaseSysCache(row);
  CatCList* operators = SearchSysCacheList1(AMOPSTRATEGY, ObjectIdGetDatum(family));
  CatCList* functions = SearchSysCacheList1(AMPROCNUM, ObjectIdGetDatum(family));
  bool is_valid = operators->n_members == 1 && functions->n_members == 0;
  for (int i = 0; i < operators->n_members; ++i) {
    const auto* member = reinterpret_cast<Form_pg_amop>(GETSTRUCT(&operators->members[i]->tuple));
    is_valid = is_valid && member->amopstrategy == 1 && member->amoppurpose == AMOP_ORDER;
  }
  ReleaseCatCacheList(functions);
  ReleaseCatCacheList(operators);
  return is_valid;
}

}  // namespace
}  // namespace loopbit::server

// NOLINTBEGIN: what PostgreSQL's macros make of it is not our style.
extern "C" {

PG_FUNCTION_INFO_V1(loopbit_index_handler);
Datum loopbit_index_handler(PG_FUNCTION_ARGS) {
  (void)fcinfo;
  using namespace loopbit::server;
  IndexAmRoutine* method = makeNode(IndexAmRoutine);
  method->amstrategies = 1;
  method->amcanorderbyop = true;
  method->amoptionalkey = true;  // rows with NULL are in the index, too
  method->amparallelvacuumoptions = VACUUM_OPTION_PARALLEL_BULKDEL;
  method->amkeytype = InvalidOid;
  method->ambuild = build_index;
  method->ambuildempty = build_empty_index;
  method->aminsert = insert;
  method->ambulkdelete = delete_dead;
  method->amvacuumcleanup = end_vacuum;
  method->amcostestimate = estimate_cost;
  method->amoptions = parse_options;
  method->amvalidate = validate_class;
  method->ambeginscan = begin_scan;
  method->amrescan = restart_scan;
  method->amgettuple = next_row;
  method->amendscan = end_scan;
  PG_RETURN_POINTER(method);
}

}  // extern "C"
// NOLINTEND
