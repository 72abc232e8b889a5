// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "content_query.hpp"
#include "postgres.hpp"

namespace loopbit::server {

// An index is one page about it, and segments. A segment is one page of coarse counts, two of
// packed counts and 112 of contents. The contents of a page are a stretch: those of rows that were
// added one after the other. Its bounds are what docs/retrieval.md calls coarse and block counts.
// Where a stretch and its bounds are follows from its number alone.

inline constexpr std::size_t kStretchContents = 15;
inline constexpr std::size_t kSegmentGroups = 7;
inline constexpr std::size_t kSegmentStretches = kSegmentGroups * kInterleaved;
inline constexpr std::size_t kPackedPages = 2;
inline constexpr std::size_t kPackedRecords = kSegmentStretches / kPackedPages;
inline constexpr std::size_t kFirstContentPage = 1 + kPackedPages;
inline constexpr std::size_t kSegmentPages = kFirstContentPage + kSegmentStretches;
static_assert(kPackedRecords <= kMaxRecords);

enum class PageKind : uint32 { index = 0x6C6F6F70, coarse, packed, contents };  // "loop" in ASCII

struct IndexPage {
  uint32 version;  ///< of the pages
  uint64 entries;  ///< ever added; entry i is in stretch i / 15
};
inline constexpr uint32 kPagesVersion = 1;

struct CoarsePage {
  uint8 counts[kSegmentGroups][kInterleaved * kCoarseCounts];
  uint16 smallest_counts[kSegmentStretches];
};

struct PackedPage {
  uint8 records[kPackedRecords][kPackedBytes];
  uint16 smallest_counts[kPackedRecords];
};

struct ContentsPage {
  uint64 contents[kStretchContents][kContentWords];
  uint16 counts[kStretchContents];         ///< |O|, or kNoContent
  ItemPointerData rows[kStretchContents];  ///< not valid = deleted
};
inline constexpr uint16 kNoContent = UINT16_MAX;  ///< of a row with NULL

constexpr BlockNumber coarse_block(uint64 stretch) {
  return static_cast<BlockNumber>(1 + stretch / kSegmentStretches * kSegmentPages);
}
constexpr BlockNumber packed_block(uint64 stretch) {
  return static_cast<BlockNumber>(coarse_block(stretch) + 1 +
                                  stretch % kSegmentStretches / kPackedRecords);
}
constexpr BlockNumber contents_block(uint64 stretch) {
  return static_cast<BlockNumber>(coarse_block(stretch) + kFirstContentPage +
                                  stretch % kSegmentStretches);
}
constexpr uint64 stretches_of(uint64 entries) {
  return (entries + kStretchContents - 1) / kStretchContents;
}

/// What a page holds behind its header.
template <typename Body>
Body& body(Page page) {  // NOLINT(readability-non-const-parameter): it is written to
  return *reinterpret_cast<Body*>(page + SizeOfPageHeaderData);
}

void init_page(Page page, PageKind kind);

/// The three pages that an entry changes.
struct EntryPages {
  Page coarse;
  Page packed;
  Page contents;
};

/// `content`: null = of a row with NULL.
void put_entry(const EntryPages& pages, uint64 entry, const void* content,
               const ItemPointerData& row);

/// A page, locked. An error if it is none of this kind.
[[nodiscard]] Buffer read_page(Relation index, BlockNumber block, PageKind kind, int lock,
                               BufferAccessStrategy strategy = nullptr);

/// Entries that were added before now.
[[nodiscard]] uint64 num_entries(Relation index);

/// Adds an entry, with what a crash needs to restore it.
void add_entry(Relation index, const void* content, const ItemPointerData& row);

}  // namespace loopbit::server
