// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "content_pages.hpp"

#include <algorithm>

namespace loopbit::server {
namespace {

struct PageEnd {
  PageKind kind;
};

template <typename Body>
constexpr bool fits_a_page() {
  return SizeOfPageHeaderData + sizeof(Body) + MAXALIGN(sizeof(PageEnd)) <= BLCKSZ &&
         SizeOfPageHeaderData % alignof(Body) == 0;
}
static_assert(fits_a_page<CoarsePage>() && fits_a_page<PackedPage>() &&
              fits_a_page<ContentsPage>());

// NOLINTNEXTLINE(readability-non-const-parameter): it is written to
PageEnd& end_of(Page page) { return *reinterpret_cast<PageEnd*>(PageGetSpecialPointer(page)); }

std::size_t body_size(PageKind kind) {
  switch (kind) {
    case PageKind::index:
      return sizeof(IndexPage);
    case PageKind::coarse:
      return sizeof(CoarsePage);
    case PageKind::packed:
      return sizeof(PackedPage);
    case PageKind::contents:
      return sizeof(ContentsPage);
  }
  return 0;
}

/// A page that may not exist yet, locked to be written. Only who holds the lock of the first page
/// asks for one.
Buffer page_to_write(Relation index, BlockNumber block) {
  while (RelationGetNumberOfBlocks(index) <= block) {
    LockRelationForExtension(index, ExclusiveLock);
    ReleaseBuffer(ReadBuffer(index, P_NEW));
    UnlockRelationForExtension(index, ExclusiveLock);
  }
  const Buffer buffer = ReadBuffer(index, block);
  LockBuffer(buffer, BUFFER_LOCK_EXCLUSIVE);
  return buffer;
}

/// An error if this extension does not know the version of the pages.
const IndexPage& about(Relation index, Page page) {
  const IndexPage& about = body<IndexPage>(page);
  if (about.version != kPagesVersion) {
    ereport(ERROR,
            (errcode(ERRCODE_OBJECT_NOT_IN_PREREQUISITE_STATE),
             errmsg("index \"%s\" has pages of version %u, but this extension knows version %u",
                    RelationGetRelationName(index), about.version, kPagesVersion),
             errhint("Please REINDEX it.")));
  }
  return about;
}

Page registered(GenericXLogState* log, Buffer buffer, PageKind kind) {
  const bool is_new = PageIsNew(BufferGetPage(buffer));
  const Page page = GenericXLogRegisterBuffer(log, buffer, is_new ? GENERIC_XLOG_FULL_IMAGE : 0);
  if (is_new) init_page(page, kind);
  return page;
}

}  // namespace

void init_page(Page page, PageKind kind) {
  PageInit(page, BLCKSZ, sizeof(PageEnd));
  end_of(page).kind = kind;
  // What lies between the two would not be logged.
  reinterpret_cast<PageHeader>(page)->pd_lower =
      static_cast<LocationIndex>(SizeOfPageHeaderData + body_size(kind));
  if (kind == PageKind::index) body<IndexPage>(page).version = kPagesVersion;
  if (kind == PageKind::coarse) {
    std::fill_n(body<CoarsePage>(page).smallest_counts, kSegmentStretches, UINT16_MAX);
  }
  if (kind == PageKind::packed) {
    std::fill_n(body<PackedPage>(page).smallest_counts, kPackedRecords, UINT16_MAX);
  }
}

void put_entry(const EntryPages& pages, uint64 entry, const void* content,
               const ItemPointerData& row) {
  const std::size_t in_segment = entry / kStretchContents % kSegmentStretches;
  const std::size_t slot = entry % kStretchContents;
  auto& contents = body<ContentsPage>(pages.contents);
  contents.rows[slot] = row;
  contents.counts[slot] = kNoContent;
  if (content == nullptr) return;
  memcpy(contents.contents[slot], content, kContentBytes);
  contents.counts[slot] = static_cast<uint16>(count(content));
  auto& coarse = body<CoarsePage>(pages.coarse);
  auto& packed = body<PackedPage>(pages.packed);
  const std::size_t record = in_segment % kPackedRecords;
  for (uint16* smallest : {&coarse.smallest_counts[in_segment], &packed.smallest_counts[record]}) {
    *smallest = std::min(*smallest, contents.counts[slot]);
  }
  raise_bounds(content, packed.records[record], coarse.counts[in_segment / kInterleaved],
               in_segment % kInterleaved);
}

Buffer read_page(Relation index, BlockNumber block, PageKind kind, int lock,
                 BufferAccessStrategy strategy) {
  const Buffer buffer = ReadBufferExtended(index, MAIN_FORKNUM, block, RBM_NORMAL, strategy);
  LockBuffer(buffer, lock);
  const Page page = BufferGetPage(buffer);
  const bool is_valid = !PageIsNew(page) && PageGetSpecialSize(page) == MAXALIGN(sizeof(PageEnd)) &&
                        end_of(page).kind == kind;
  if (!is_valid) {
    ereport(ERROR,
            (errcode(ERRCODE_INDEX_CORRUPTED),
             errmsg("block %u of index \"%s\" is damaged", block, RelationGetRelationName(index)),
             errhint("Please REINDEX it.")));
  }
  return buffer;
}

uint64 num_entries(Relation index) {
  const Buffer buffer = read_page(index, 0, PageKind::index, BUFFER_LOCK_SHARE);
  const uint64 entries = about(index, BufferGetPage(buffer)).entries;
  UnlockReleaseBuffer(buffer);
  return entries;
}

void add_entry(Relation index, const void* content, const ItemPointerData& row) {
  const Buffer first = read_page(index, 0, PageKind::index, BUFFER_LOCK_EXCLUSIVE);
  const uint64 entry = about(index, BufferGetPage(first)).entries;
  const uint64 stretch = entry / kStretchContents;
  const Buffer coarse = page_to_write(index, coarse_block(stretch));
  const Buffer packed = page_to_write(index, packed_block(stretch));
  const Buffer contents = page_to_write(index, contents_block(stretch));
  GenericXLogState* log = GenericXLogStart(index);
  body<IndexPage>(GenericXLogRegisterBuffer(log, first, 0)).entries = entry + 1;
  put_entry({.coarse = registered(log, coarse, PageKind::coarse),
             .packed = registered(log, packed, PageKind::packed),
             .contents = registered(log, contents, PageKind::contents)},
            entry, content, row);
  GenericXLogFinish(log);
  for (const Buffer buffer : {contents, packed, coarse, first}) UnlockReleaseBuffer(buffer);
}

}  // namespace loopbit::server
