// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The extension of PostgreSQL servers, part of the program fleet_map_test.
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libpq-fe.h>

#include "loopbit/binary_content.hpp"
#include "loopbit/fleet_map.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"

#include "full_scan.hpp"
#include "map_support.hpp"
#include "place_contents.hpp"
#include "place_memory.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

using Result = std::unique_ptr<PGresult, decltype(&PQclear)>;

std::string hex_of(const BinaryContent& content) {
  std::string hex = "\\x";
  const auto* bytes = reinterpret_cast<const unsigned char*>(content.rows.data());
  for (std::size_t i = 0; i < sizeof content.rows; ++i) hex += fmt::format("{:02x}", bytes[i]);
  return hex;
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

/// A row of the table `place`, which has the columns id and c.
struct Row {
  int id;
  std::optional<BinaryContent> content;
};

struct Similar {
  double similarity;
  int id;

  bool operator==(const Similar&) const = default;
};

class ServerSearch : public testing::Test {
 protected:
  void SetUp() override {
    if (rows_of("SELECT FROM pg_available_extensions WHERE name = 'loopbit'").empty()) {
      GTEST_SKIP() << "the server does not have the extension";
    }
    run("SET client_min_messages = warning; DROP SCHEMA IF EXISTS loopbit CASCADE; DROP TABLE IF "
        "EXISTS t; DROP EXTENSION IF EXISTS loopbit; CREATE EXTENSION loopbit; CREATE TABLE t (id "
        "integer, c binary_content) WITH (autovacuum_enabled = off)");
  }

  Result ask(const std::string& sql, const std::vector<std::string>& values = {}) {
    std::vector<const char*> parameters;
    for (const std::string& value : values) parameters.push_back(value.c_str());
    return {values.empty()
                ? PQexec(connection_.get(), sql.c_str())
                : PQexecParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()),
                               nullptr, parameters.data(), nullptr, nullptr, 0),
            PQclear};
  }

  void run(const std::string& sql, const std::vector<std::string>& values = {}) {
    EXPECT_LE(PQresultStatus(ask(sql, values).get()), PGRES_TUPLES_OK)
        << PQerrorMessage(connection_.get());
  }

  std::vector<std::vector<std::string>> rows_of(const std::string& sql,
                                                const std::vector<std::string>& values = {}) {
    const Result result = ask(sql, values);
    EXPECT_LE(PQresultStatus(result.get()), PGRES_TUPLES_OK) << PQerrorMessage(connection_.get());
    std::vector<std::vector<std::string>> rows;
    for (int row = 0; row < PQntuples(result.get()); ++row) {
      rows.emplace_back();
      for (int column = 0; column < PQnfields(result.get()); ++column) {
        rows.back().emplace_back(PQgetvalue(result.get(), row, column));
      }
    }
    return rows;
  }

  void expect_refused(const std::string& sql, const std::string& why) {
    EXPECT_EQ(PQresultStatus(ask(sql).get()), PGRES_FATAL_ERROR) << sql;
    EXPECT_THAT(PQerrorMessage(connection_.get()), testing::HasSubstr(why)) << sql;
  }

  void insert(const std::vector<Row>& rows) {
    run("BEGIN");
    for (const Row& row : rows) {
      run(fmt::format("INSERT INTO t VALUES ({}, {})", row.id,
                      row.content ? "'" + hex_of(*row.content) + "'" : "NULL"));
    }
    run("COMMIT");
  }

  /// The most similar rows, more if the last ones are equal, by the index.
  std::vector<Similar> most_similar(const BinaryContent& query, int number, int tolerance) {
    run(fmt::format("SET enable_seqscan = off; SET loopbit.shift_tolerance_columns = {}",
                    tolerance));
    std::vector<Similar> found;
    for (const auto& row : rows_of(
             fmt::format("SELECT id, similarity($1, c, {}) FROM t ORDER BY c <~> $1 FETCH FIRST {} "
                         "ROWS WITH TIES",
                         tolerance, number),
             {hex_of(query)})) {
      found.push_back({row[1].empty() ? -1.0 : std::stod(row[1]), std::stoi(row[0])});
    }
    sort(found);
    return found;
  }

  /// Likewise by the library, one row after the other. Rows without a content come last.
  static std::vector<Similar> scan(const std::vector<Row>& rows, const BinaryContent& query,
                                   std::size_t number, int tolerance) {
    std::vector<Similar> all;
    for (const Row& row : rows) {
      all.push_back({row.content ? similarity(query, *row.content, tolerance) : -1.0, row.id});
    }
    sort(all);
    while (number < all.size() && all[number].similarity == all[number - 1].similarity) ++number;
    all.resize(std::min(number, all.size()));
    return all;
  }

  static void sort(std::vector<Similar>& rows) {
    std::sort(rows.begin(), rows.end(), [](const Similar& a, const Similar& b) {
      return std::tuple(-a.similarity, a.id) < std::tuple(-b.similarity, b.id);
    });
  }

  std::unique_ptr<PGconn, decltype(&PQfinish)> connection_{
      PQconnectdb(std::getenv("LOOPBIT_FLEET_ADDRESS")), PQfinish};
};

/// A drive of which every fifth place is there twice, with empty, full and missing contents.
std::vector<Row> drive(Random& random, int first_id, int number) {
  std::vector<Row> rows;
  for (const BinaryContent& content : coherent_contents(random, number)) {
    const int id = first_id + static_cast<int>(rows.size());
    rows.push_back({id, content});
    if (id % 5 == 0) rows.push_back({id + 1, content});
    if (id % 61 == 0) rows.push_back({id + 2, BinaryContent{}});
    if (id % 97 == 0) rows.push_back({id + 3, std::nullopt});
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].id = first_id + static_cast<int>(i);
  rows.push_back({first_id + static_cast<int>(rows.size()), full_content()});
  return rows;
}

TEST_F(ServerSearch, SimilaritiesAreThoseOfTheLibrary) {
  Random random;
  std::vector<BinaryContent> contents = random_contents(random, 20);
  contents.push_back({});
  contents.push_back(full_content());
  for (const BinaryContent& a : contents) {
    for (const BinaryContent& b : contents) {
      const auto row = rows_of(
          "SELECT similarity($1, $2), similarity($1, $2, 1), similarity($1, $2, 4), similarity($1, "
          "$2, 32), 1 - ($2::binary_content <~> $1::binary_content)",
          {hex_of(a), hex_of(b)})[0];
      const std::vector<double> expected{similarity(a, b), similarity(a, b, 1), similarity(a, b, 4),
                                         similarity(a, b, 32), 1 - (1 - similarity(a, b, 4))};
      for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(std::stod(row[i]), expected[i]);
    }
  }
}

TEST_F(ServerSearch, ListsAreThoseOfAScan) {
  Random random;
  std::vector<Row> rows = drive(random, 0, 1500);
  insert({rows.begin(), rows.begin() + 900});
  run("CREATE INDEX i ON t USING loopbit (c)");
  insert({rows.begin() + 900, rows.end()});
  std::vector<BinaryContent> queries = random_contents(random, 30);
  queries.push_back({});
  queries.push_back(full_content());
  for (std::size_t i = 0; i < rows.size(); i += 31) {
    if (rows[i].content)
      queries.push_back(shift_columns(*rows[i].content, static_cast<int>(i) % 9 - 4));
  }
  for (const BinaryContent& query : queries) {
    const int tolerance = query == queries.back() ? 32 : 4;
    for (const int number : {1, 30}) {
      EXPECT_EQ(most_similar(query, number, tolerance),
                scan(rows, query, static_cast<std::size_t>(number), tolerance));
    }
  }
  const auto all = static_cast<int>(rows.size());
  EXPECT_EQ(most_similar(queries[40], all, 4), scan(rows, queries[40], rows.size(), 4));
}

TEST_F(ServerSearch, ListsFollowInsertionDeletionAndVacuum) {
  Random random;
  run("CREATE INDEX i ON t USING loopbit (c)");
  const BinaryContent query = random_content(random, 0.3);
  EXPECT_EQ(most_similar(query, 30, 4), std::vector<Similar>());
  std::vector<Row> rows;
  for (int round = 0; round < 4; ++round) {
    const std::vector<Row> added = drive(random, 1000 * round, 300);
    insert(added);
    rows.insert(rows.end(), added.begin(), added.end());
    run(fmt::format("DELETE FROM t WHERE id % 4 = {}", round));
    std::erase_if(rows, [&](const Row& row) { return row.id % 4 == round; });
    EXPECT_EQ(most_similar(*added.front().content, 50, 4),
              scan(rows, *added.front().content, 50, 4));
    run("VACUUM t");
    for (const BinaryContent& asked : {query, *added.front().content, *added.back().content}) {
      EXPECT_EQ(most_similar(asked, 50, 4), scan(rows, asked, 50, 4));
    }
  }
  const BinaryContent changed = random_content(random, 0.2);
  run(fmt::format("UPDATE t SET c = '{}' WHERE id = {}", hex_of(changed), rows.front().id));
  rows.front().content = changed;
  run("VACUUM t");
  run("REINDEX INDEX CONCURRENTLY i");
  EXPECT_EQ(most_similar(changed, 50, 4), scan(rows, changed, 50, 4));
}

TEST_F(ServerSearch, TheIndexIsUsed) {
  Random random;
  insert(drive(random, 0, 3000));
  run("CREATE INDEX i ON t USING loopbit (c); ANALYZE t; RESET enable_seqscan");
  const auto plan = rows_of("EXPLAIN SELECT id FROM t ORDER BY c <~> $1 LIMIT 30",
                            {hex_of(coherent_contents(random, 1)[0])});
  EXPECT_THAT(plan[1][0], testing::HasSubstr("Index Scan using i"));
}

TEST_F(ServerSearch, AnyOrderWithoutAQuery) {
  Random random;
  const std::vector<Row> rows = drive(random, 0, 100);
  insert(rows);
  run("CREATE INDEX i ON t USING loopbit (c); SET enable_seqscan = off");
  const auto found = rows_of("SELECT id FROM t ORDER BY c <~> NULL");
  EXPECT_EQ(found.size(), rows.size());
}

/// A map whose two sessions have these contents, alternately 100 at a time.
void write_map(const std::string& address, const std::vector<Row>& rows) {
  for (const std::size_t session : {0U, 1U}) {
    MapWriter map(address, fast_options(), "drive");
    int frame = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (i / 100 % 2 != session) continue;
      map.add({.frame = frame++, .status = Status::no_similar_place},
              rows[i].content.value_or(BinaryContent{}),
              std::make_shared<const Features>(few_features(1)), {});
    }
    map.finish();
  }
}

TEST_F(ServerSearch, CandidatesOfAMapAreThoseOfAnIndex) {
  const std::string address = std::getenv("LOOPBIT_FLEET_ADDRESS");
  run("DROP TABLE t");
  run("DROP EXTENSION loopbit");
  use_fleet_maps();
  ASSERT_TRUE(create_map(address));
  ASSERT_EQ(setenv("PGOPTIONS", "-c enable_seqscan=off", 1), 0);
  Random random;
  const std::vector<Row> rows = drive(random, 0, 1200);
  write_map(address, rows);
  run("UPDATE loopbit.place SET checksum = checksum + 1 WHERE frame IN (3, 77, 500)");

  auto map = std::make_shared<MapReader>(address);
  ASSERT_NE(map->place_search(), nullptr);
  PlaceMemory memory(map);
  memory.restore_searched(0.8);
  const PlaceContents searched(memory);
  EXPECT_EQ(map->damage().size(), 6U);
  PlaceIndex index;
  MapReader whole(address);
  BinaryContent latest_step;
  std::ptrdiff_t steps = 0;
  whole.for_each_earlier_place([&](const SessionFrame& at, const BinaryContent& content) {
    EXPECT_EQ(memory.origin(index.size()), at);
    const bool is_step =
        index.size() == 0 || (count(content) > 0 && similarity(content, latest_step) < 0.8);
    if (is_step) latest_step = content;
    steps += is_step ? 1 : 0;
    index.add(content);
  });
  EXPECT_EQ(whole.damage(), map->damage());
  ASSERT_EQ(searched.size(), index.size());
  EXPECT_GT(steps, 100);
  EXPECT_EQ(memory.earlier_steps(), steps);
  for (PlaceId place = 0; place < index.size(); place += 50) {
    EXPECT_EQ(searched.content(place), index.content(place));
  }

  int asked = 0;
  std::size_t candidates = 0;
  const auto compare = [&](const BinaryContent& query, const RetrievalOptions& options,
                           const PlaceTest& is_allowed = {}) {
    const PlaceId end = asked++ % 5 == 0 ? index.size() - 250 : index.size();
    const auto expected = index.query(query, end, options, nullptr, is_allowed);
    candidates += expected.size();
    EXPECT_EQ(searched.query(query, end, options, is_allowed), expected);
  };
  for (std::size_t i = 0; i < rows.size(); i += 2) {
    const BinaryContent content = rows[i].content.value_or(BinaryContent{});
    compare(shift_columns(content, static_cast<int>(i) % 9 - 4), {});
    if (i % 20 != 0) continue;
    compare(content, {.max_candidates = 1000, .min_similarity = 0});
    compare(content, {.max_candidates = 3, .shift_tolerance_columns = 32, .min_spacing = 40});
    compare(content, {.shift_tolerance_columns = 0, .max_center_distance_px = 1.5});
    compare(content, {}, [](PlaceId place) { return place % 50 == 7; });
    compare(content, {.min_spacing = 1}, [](PlaceId) { return false; });
  }
  for (const BinaryContent& query : random_contents(random, 100)) compare(query, {});
  EXPECT_GT(asked, 1000);
  EXPECT_GT(candidates, 10'000U);
  unsetenv("PGOPTIONS");
}

TEST_F(ServerSearch, OtherSizesAndNonsenseAreRefused) {
  run("CREATE INDEX i ON t USING loopbit (c)");
  expect_refused("SELECT 'short'::bytea::binary_content", "has 512 bytes, not 5");
  expect_refused("SELECT decode(repeat('00', 513), 'hex')::binary_content",
                 "has 512 bytes, not 513");
  expect_refused("SELECT ''::bytea::binary_content", "has 512 bytes, not 0");
  expect_refused("INSERT INTO t VALUES (1, 'pixels')", "1024 hexadecimal digits");
  expect_refused("INSERT INTO t VALUES (1, '\\x" + repeated("00", 511) + "')", "1024 hexadecimal");
  expect_refused("INSERT INTO t VALUES (1, '\\x" + repeated("00", 511) + "0g')", "byte 511");
  expect_refused("SELECT similarity(c, c, 33) FROM (SELECT '\\x" + repeated("ff", 512) +
                     "'::binary_content AS c) AS full_one",
                 "from 0 to 32");
  expect_refused("SET loopbit.shift_tolerance_columns = -1", "outside the valid range");
  expect_refused("SET loopbit.other = 1", "reserved prefix");
  expect_refused("CREATE INDEX ON t USING loopbit (id)", "no default operator class");
  expect_refused("CREATE INDEX ON t USING loopbit (c) WITH (fillfactor = 50)", "unrecognized");
  expect_refused("CREATE UNIQUE INDEX ON t USING loopbit (c)", "does not support unique");
  expect_refused("SELECT loopbit_index_handler(NULL)", "");
  EXPECT_EQ(rows_of("SELECT count(*) FROM t")[0][0], "0");
  EXPECT_EQ(
      rows_of("SELECT amvalidate(oid) FROM pg_opclass WHERE opcname = 'binary_content_ops'")[0][0],
      "t");
}

TEST_F(ServerSearch, ContentsGoInAndOutUnchanged) {
  Random random;
  const std::string hex = hex_of(random_content(random, 0.5));
  const auto row = rows_of(
      "SELECT $1::binary_content::bytea, $1::bytea::binary_content, "
      "binary_content_send($1::binary_content)",
      {hex})[0];
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(row[i], hex);
  std::string upper = hex;
  std::transform(upper.begin() + 2, upper.end(), upper.begin() + 2,
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  EXPECT_EQ(rows_of("SELECT $1::binary_content", {upper})[0][0], hex);
}

}  // namespace
}  // namespace loopbit::test
