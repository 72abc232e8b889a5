// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The functions of loopbit--*.sql, but for those of the index.
#include <array>
#include <cmath>

#include <libdeflate.h>

#include "content_query.hpp"
#include "postgres.hpp"
#include "settings.hpp"

namespace loopbit::server {
namespace {

int tolerance_setting = kDefaultTolerance_columns;

constexpr std::size_t kHexDigits = 2 * kContentBytes;

char* new_content() { return static_cast<char*>(palloc(kContentBytes)); }

int digit_value(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  const int lower = digit | 0x20;
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

void refuse_size(std::size_t bytes) {
  ereport(ERROR, (errcode(ERRCODE_INVALID_BINARY_REPRESENTATION),
                  errmsg("a binary_content has %zu bytes, not %zu", kContentBytes, bytes),
                  errhint("Give the 64 rows of 64 pixels, 8 bytes each.")));
}

/// The query that the function was called with before, if it is the same one. A scan of a table
/// asks for thousands of places with one query.
const ContentQuery& prepared(FunctionCallInfo call, const void* content, int tolerance_columns) {
  auto* query = static_cast<ContentQuery*>(call->flinfo->fn_extra);
  const bool is_known = query != nullptr && query->tolerance_columns == tolerance_columns &&
                        memcmp(query->content.data(), content, kContentBytes) == 0;
  if (is_known) return *query;
  if (query == nullptr) {
    query =
        static_cast<ContentQuery*>(MemoryContextAlloc(call->flinfo->fn_mcxt, sizeof(ContentQuery)));
  }
  call->flinfo->fn_extra = nullptr;  // until it is whole
  prepare_or_fail(content, tolerance_columns, *query);
  call->flinfo->fn_extra = query;
  return *query;
}

double similarity_to(const ContentQuery& query, const void* place) {
  uint16 overlap = 0;
  max_overlaps(query, place, 1, &overlap);
  return similarity(query, overlap, count(place));
}

/// What changes_view() knows of the rows before.
struct LatestView {
  bool is_known;
  ContentQuery content;
};

/// Whether a row shows another view than the latest one that did.
bool changes_view(LatestView& latest, const void* content, double unmoved) {
  if (latest.is_known) {
    const bool is_empty = count(content) == 0;
    if (is_empty || similarity_to(latest.content, content) >= unmoved) return false;
  }
  prepare_or_fail(content, 0, latest.content);
  latest.is_known = true;
  return true;
}

/// None of a session or frame that no place has, or of a time that is not finite.
bool is_place(int64 session, int64 frame, double timestamp) {
  const auto is_number = [](int64 value) { return value >= 0 && value <= INT32_MAX; };
  return is_number(session) && is_number(frame) && std::isfinite(timestamp);
}

}  // namespace

int shift_tolerance_columns() { return tolerance_setting; }

void prepare_or_fail(const void* content, int tolerance_columns, ContentQuery& query) {
  if (prepare(content, tolerance_columns, query)) return;
  ereport(ERROR, (errcode(ERRCODE_OUT_OF_MEMORY), errmsg("loopbit cannot compare contents"),
                  errhint("Free memory; if the server's environment has LOOPBIT_KERNEL, it has to "
                          "name an instruction set of its processor.")));
}

}  // namespace loopbit::server

// NOLINTBEGIN: what PostgreSQL's macros make of it is not our style.
extern "C" {

using loopbit::server::kContentBytes;

PG_MODULE_MAGIC;

void _PG_init() {
  DefineCustomIntVariable(
      "loopbit.shift_tolerance_columns",
      "By how many of its 64 columns <~> shifts the query at most, either way.", nullptr,
      &loopbit::server::tolerance_setting, loopbit::server::kDefaultTolerance_columns, 0,
      loopbit::server::kMaxTolerance_columns, PGC_USERSET, 0, nullptr, nullptr, nullptr);
  MarkGUCPrefixReserved("loopbit");
}

PG_FUNCTION_INFO_V1(loopbit_content_in);
Datum loopbit_content_in(PG_FUNCTION_ARGS) {
  const char* hex = PG_GETARG_CSTRING(0);
  const std::size_t size = strlen(hex);
  if (size != loopbit::server::kHexDigits + 2 || hex[0] != '\\' || hex[1] != 'x') {
    ereport(ERROR, (errcode(ERRCODE_INVALID_TEXT_REPRESENTATION),
                    errmsg("a binary_content is written as \\x and %zu hexadecimal digits",
                           loopbit::server::kHexDigits)));
  }
  char* content = loopbit::server::new_content();
  for (std::size_t i = 0; i < kContentBytes; ++i) {
    const int upper = loopbit::server::digit_value(hex[2 + 2 * i]);
    const int lower = loopbit::server::digit_value(hex[3 + 2 * i]);
    if (upper < 0 || lower < 0) {
      ereport(ERROR, (errcode(ERRCODE_INVALID_TEXT_REPRESENTATION),
                      errmsg("byte %zu of a binary_content is not hexadecimal", i)));
    }
    content[i] = static_cast<char>(upper << 4 | lower);
  }
  PG_RETURN_POINTER(content);
}

PG_FUNCTION_INFO_V1(loopbit_content_out);
Datum loopbit_content_out(PG_FUNCTION_ARGS) {
  char* hex = static_cast<char*>(palloc(loopbit::server::kHexDigits + 3));
  hex[0] = '\\';
  hex[1] = 'x';
  hex_encode(PG_GETARG_POINTER(0), kContentBytes, hex + 2);
  hex[2 + loopbit::server::kHexDigits] = '\0';
  PG_RETURN_CSTRING(hex);
}

PG_FUNCTION_INFO_V1(loopbit_content_recv);
Datum loopbit_content_recv(PG_FUNCTION_ARGS) {
  auto* message = reinterpret_cast<StringInfo>(PG_GETARG_POINTER(0));
  const auto size = static_cast<std::size_t>(message->len - message->cursor);
  if (size != kContentBytes) loopbit::server::refuse_size(size);
  char* content = loopbit::server::new_content();
  pq_copymsgbytes(message, content, static_cast<int>(kContentBytes));
  PG_RETURN_POINTER(content);
}

PG_FUNCTION_INFO_V1(loopbit_content_to_bytes);
Datum loopbit_content_to_bytes(PG_FUNCTION_ARGS) {
  auto* bytes = static_cast<bytea*>(palloc(kContentBytes + VARHDRSZ));
  SET_VARSIZE(bytes, kContentBytes + VARHDRSZ);
  memcpy(VARDATA(bytes), PG_GETARG_POINTER(0), kContentBytes);
  PG_RETURN_BYTEA_P(bytes);
}

PG_FUNCTION_INFO_V1(loopbit_content_from_bytes);
Datum loopbit_content_from_bytes(PG_FUNCTION_ARGS) {
  const bytea* bytes = PG_GETARG_BYTEA_PP(0);
  const std::size_t size = VARSIZE_ANY_EXHDR(bytes);
  if (size != kContentBytes) loopbit::server::refuse_size(size);
  char* content = loopbit::server::new_content();
  memcpy(content, VARDATA_ANY(bytes), kContentBytes);
  PG_RETURN_POINTER(content);
}

PG_FUNCTION_INFO_V1(loopbit_similarity);
Datum loopbit_similarity(PG_FUNCTION_ARGS) {
  const int tolerance = PG_GETARG_INT32(2);
  if (tolerance < 0 || tolerance > loopbit::server::kMaxTolerance_columns) {
    ereport(ERROR, (errcode(ERRCODE_NUMERIC_VALUE_OUT_OF_RANGE),
                    errmsg("shift_tolerance_columns is %d, but has to be from 0 to %d", tolerance,
                           loopbit::server::kMaxTolerance_columns)));
  }
  const auto& shifted = loopbit::server::prepared(fcinfo, PG_GETARG_POINTER(0), tolerance);
  PG_RETURN_FLOAT8(loopbit::server::similarity_to(shifted, PG_GETARG_POINTER(1)));
}

PG_FUNCTION_INFO_V1(loopbit_distance);
Datum loopbit_distance(PG_FUNCTION_ARGS) {
  const auto& query = loopbit::server::prepared(fcinfo, PG_GETARG_POINTER(1),
                                                loopbit::server::shift_tolerance_columns());
  PG_RETURN_FLOAT8(1 - loopbit::server::similarity_to(query, PG_GETARG_POINTER(0)));
}

PG_FUNCTION_INFO_V1(loopbit_place_checksum);
Datum loopbit_place_checksum(PG_FUNCTION_ARGS) {
  if (PG_ARGISNULL(0) || PG_ARGISNULL(1) || PG_ARGISNULL(3)) PG_RETURN_NULL();
  const std::array<int64, 2> at{PG_GETARG_INT64(0), PG_GETARG_INT64(1)};
  const double timestamp = PG_ARGISNULL(2) ? 0.0 : PG_GETARG_FLOAT8(2) + 0.0;  // not -0
  if (!loopbit::server::is_place(at[0], at[1], timestamp)) PG_RETURN_NULL();
  std::uint32_t checksum = libdeflate_crc32(0, at.data(), sizeof at);
  checksum = libdeflate_crc32(checksum, &timestamp, sizeof timestamp);
  PG_RETURN_INT64(libdeflate_crc32(checksum, PG_GETARG_POINTER(3), kContentBytes));
}

PG_FUNCTION_INFO_V1(loopbit_changes_view);
Datum loopbit_changes_view(PG_FUNCTION_ARGS) {
  const WindowObject window = PG_WINDOW_OBJECT();
  auto* latest = static_cast<loopbit::server::LatestView*>(
      WinGetPartitionLocalMemory(window, sizeof(loopbit::server::LatestView)));
  std::array<bool, 3> is_null{};
  const Datum content = WinGetFuncArgCurrent(window, 0, &is_null[0]);
  const double unmoved = DatumGetFloat8(WinGetFuncArgCurrent(window, 1, &is_null[1]));
  const bool is_whole = DatumGetBool(WinGetFuncArgCurrent(window, 2, &is_null[2]));
  WinSetMarkPosition(window, WinGetCurrentPosition(window));  // rows before are not needed
  if (is_null[0] || is_null[1] || is_null[2] || !is_whole) PG_RETURN_NULL();
  PG_RETURN_BOOL(loopbit::server::changes_view(*latest, DatumGetPointer(content), unmoved));
}

}  // extern "C"
// NOLINTEND
