// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// How similar places are found by the extension of a PostgreSQL server: see scripts/bench_fleet.
#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <libpq-fe.h>

#include "loopbit/fleet_map.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/sharded_map.hpp"

#include "long_sequence.hpp"
#include "measure.hpp"
#include "place_contents.hpp"
#include "place_memory.hpp"

namespace {

using namespace loopbit;         // NOLINT(google-build-using-namespace)
using namespace loopbit::bench;  // NOLINT(google-build-using-namespace)
using Clock = std::chrono::steady_clock;

constexpr std::size_t kInserted = 5'000;  ///< places that are added to a finished index
constexpr std::size_t kTimed = 200;       ///< queries whose times count; half are revisits
constexpr int kRepetitions = 5;           ///< the fastest counts: other programs run, too
constexpr std::size_t kScans = 3;

double ms_of(const std::function<void()>& work) {
  const auto start = Clock::now();
  work();
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::string hex_of(const BinaryContent& content) {
  std::string hex = "\\x";
  const auto* bytes = reinterpret_cast<const unsigned char*>(content.rows.data());
  for (std::size_t i = 0; i < sizeof content.rows; ++i) hex += fmt::format("{:02x}", bytes[i]);
  return hex;
}

/// A connection of its own, beside that of the map.
class Server {
 public:
  explicit Server(const std::string& address)
      : connection_(PQconnectdb(address.c_str()), PQfinish) {
    run("SET search_path = loopbit");
  }

  /// The values of the first column.
  std::vector<std::string> run(const std::string& sql) {
    const std::unique_ptr<PGresult, decltype(&PQclear)> result(
        PQexec(connection_.get(), sql.c_str()), PQclear);
    const ExecStatusType status = PQresultStatus(result.get());
    if (status == PGRES_FATAL_ERROR) throw std::runtime_error(PQerrorMessage(connection_.get()));
    std::vector<std::string> values;
    for (int row = 0; row < PQntuples(result.get()); ++row) {
      values.emplace_back(PQgetvalue(result.get(), row, 0));
    }
    return values;
  }

  double number(const std::string& sql) { return std::stod(run(sql).at(0)); }

  void send(const std::string& text) {
    if (PQputCopyData(connection_.get(), text.data(), static_cast<int>(text.size())) != 1) {
      throw std::runtime_error(PQerrorMessage(connection_.get()));
    }
  }

  void end_sending() {
    if (PQputCopyEnd(connection_.get(), nullptr) != 1) {
      throw std::runtime_error(PQerrorMessage(connection_.get()));
    }
    while (PGresult* result = PQgetResult(connection_.get())) {
      const bool is_done = PQresultStatus(result) == PGRES_COMMAND_OK;
      PQclear(result);
      if (!is_done) throw std::runtime_error(PQerrorMessage(connection_.get()));
    }
  }

 private:
  std::unique_ptr<PGconn, decltype(&PQfinish)> connection_;
};

/// Adds the places of a session to the map of the server, which is made, and to the index.
class Builder {
 public:
  Builder(Server& server, const std::string& address, LongSequence& sequence, PlaceIndex& index)
      : server_(server), sequence_(sequence), index_(index), first_(index.size()) {
    MapWriter map(address, {}, "bench_search");
    map.add({.status = Status::no_similar_place}, next(), std::make_shared<const Features>(), {});
    map.finish();
    session_ = map.session();
    // Other tables are not asked about each place.
    server.run(
        "SET session_replication_role = replica; DROP INDEX IF EXISTS place_content; "
        "CREATE TEMP TABLE new (frame bigint, content bytea)");
  }

  /// Adds places until the index has this number; returns how long the server took.
  double grow_to(std::size_t places) {
    server_.run("COPY new FROM STDIN");
    while (static_cast<std::size_t>(index_.size()) < places) {
      const PlaceId frame = index_.size() - first_;
      server_.send(fmt::format("{}\t\\{}\n", frame, hex_of(next())));
    }
    server_.end_sending();
    const double ms = ms_of([&] {
      server_.run(
          fmt::format("INSERT INTO place (place, session, frame, content, checksum, batch) SELECT "
                      "({0}::bigint << 32) + frame, {0}, frame, content, place_checksum({0}, "
                      "frame, NULL, content::binary_content), 1 FROM new",
                      session_));
    });
    server_.run("TRUNCATE new");
    return ms;
  }

 private:
  const BinaryContent& next() { return index_.content(index_.add(sequence_.next())); }

  Server& server_;
  LongSequence& sequence_;
  PlaceIndex& index_;
  PlaceId first_;
  int session_ = 0;
};

/// Every other one is a revisit, the others are new places.
std::vector<BinaryContent> make_queries(const LongSequence& map, const LongSequence& elsewhere,
                                        std::size_t places, std::size_t number) {
  const std::size_t key_frames = places / LongSequence::kFramesPerKeyFrame;
  std::vector<BinaryContent> queries;
  for (std::size_t i = 0; i < number; ++i) {
    queries.push_back(i % 2 == 0 ? map.revisit(i / 2 * 7'919 % key_frames)
                                 : elsewhere.key_frame_of_lap(i / 2 * 37));
  }
  return queries;
}

/// What a detector asks the server for first; see PlaceContents.
std::string search_for(const BinaryContent& query) {
  const std::string content = fmt::format("'{}'::binary_content", hex_of(query));
  return fmt::format(
      "SELECT place, similarity({0}, content::binary_content, 4) FROM place ORDER BY "
      "content::binary_content <~> {0} FETCH FIRST 90 ROWS WITH TIES",
      content);
}

/// Pages of the index and the table that a search reads.
double pages_of(Server& server, const BinaryContent& query) {
  for (const std::string& line :
       server.run(fmt::format("EXPLAIN (ANALYZE, BUFFERS, COSTS OFF) {}", search_for(query)))) {
    const auto number_after = [&](const std::string& name) {
      const auto at = line.find(name);
      return at == std::string::npos ? 0.0 : std::stod(line.substr(at + name.size()));
    };
    if (line.find("Buffers:") == std::string::npos) continue;
    return number_after("hit=") + number_after("read=");
  }
  throw std::runtime_error("the plan does not tell of buffers");
}

double fastest(const std::function<void()>& work) {
  double best = ms_of(work);
  for (int i = 1; i < kRepetitions; ++i) best = std::min(best, ms_of(work));
  return best;
}

/// The lists that are those of the index, and the times of both.
void compare(const PlaceContents& searched, const PlaceIndex& index,
             const std::vector<BinaryContent>& queries) {
  std::size_t identical = 0;
  std::vector<double> server_ms;
  std::vector<double> embedded_ms;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const BinaryContent& query = queries[i];
    identical += searched.query(query, index.size(), {}) == index.query(query, index.size());
    if (i >= kTimed) continue;
    server_ms.push_back(fastest([&] { (void)searched.query(query, index.size(), {}); }));
    embedded_ms.push_back(fastest([&] { (void)index.query(query, index.size()); }));
  }
  fmt::print(
      "places={} identical_lists={} of={} server_p50_ms={:.2f} server_p99_ms={:.2f} "
      "embedded_p50_ms={:.2f}",
      index.size(), identical, queries.size(), percentile(server_ms, 0.5),
      percentile(server_ms, 0.99), percentile(embedded_ms, 0.5));
}

void measure_scans(Server& server, const std::vector<BinaryContent>& queries) {
  server.run("SET enable_indexscan = off; SET max_parallel_workers_per_gather = 0");
  std::vector<double> times;
  for (std::size_t i = 0; i < kScans; ++i) {
    times.push_back(fastest([&] { server.run(search_for(queries[i])); }));
  }
  server.run("RESET enable_indexscan");
  double pages = 0;
  const std::size_t asked = std::min(kTimed, queries.size());
  for (std::size_t i = 0; i < asked; ++i) pages += pages_of(server, queries[i]);
  fmt::print(" scan_ms={:.1f} pages_read={:.0f}", percentile(times, 0.5),
             pages / static_cast<double>(asked));
}

/// Makes the index of the server's extension.
void make_index(Server& server) {
  server.run("CREATE INDEX place_content ON place USING loopbit ((content::binary_content))");
}

/// What is put into maps, and asked.
struct Drives {
  explicit Drives(const std::string& data)
      : map(data, {"kitti03", "office_tour", "lateral_corridor"}, 21, 6),
        elsewhere(data, {"euroc_room"}, 91, 1) {}

  LongSequence map;
  LongSequence elsewhere;
};

/// Each shard has a session of as many places.
void run_shards(Drives& drives, const std::vector<std::string>& addresses, std::size_t places,
                std::size_t queries) {
  PlaceIndex index;
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    const std::string& address = addresses[i];
    const int session = static_cast<int>(i) + 1;
    if (!create_map(address, session)) throw std::runtime_error("there is a map already");
    Server server(address);
    Builder(server, address, drives.map, index).grow_to(places * (i + 1) / addresses.size());
    make_index(server);
    server.run("VACUUM ANALYZE place");
  }
  PlaceMemory memory(std::make_shared<ShardedMap>(addresses));
  const double open_ms = ms_of([&] { memory.restore_searched(0.8); });
  compare(PlaceContents(memory), index,
          make_queries(drives.map, drives.elsewhere, places, queries));
  fmt::print(" open_s={:.2f}\n", open_ms / 1e3);
}

void run_one(Drives& drives, const std::string& address, std::size_t places,
             std::size_t number_of_queries) {
  if (!create_map(address)) throw std::runtime_error("there is a map already");
  Server server(address);
  LongSequence& map = drives.map;
  PlaceIndex index;
  Builder builder(server, address, map, index);
  builder.grow_to(places - 2 * kInserted);
  const double plain_ms = builder.grow_to(places - kInserted);
  const double build_ms = ms_of([&] { make_index(server); });
  const double insert_ms = builder.grow_to(places);
  server.run("VACUUM ANALYZE place");
  auto reader = std::make_shared<MapReader>(address);
  PlaceMemory memory(reader);
  const double open_ms = ms_of([&] { memory.restore_searched(0.8); });
  const auto queries = make_queries(map, drives.elsewhere, places, number_of_queries);
  compare(PlaceContents(memory), index, queries);
  measure_scans(server, queries);
  fmt::print(
      " index_bytes_per_place={:.0f} build_s={:.2f} open_s={:.2f} insert_us={:.1f} "
      "insert_without_index_us={:.1f}\n",
      server.number("SELECT pg_relation_size('place_content')") / static_cast<double>(places),
      build_ms / 1e3, open_ms / 1e3, 1e3 * insert_ms / kInserted, 1e3 * plain_ms / kInserted);
}

/// bench_search DATA ADDRESSES PLACES QUERIES: one line of fields.
void run(const std::vector<std::string>& arguments) {
  if (arguments.size() != 4) {
    throw std::runtime_error("usage: bench_search DATA ADDRESSES PLACES QUERIES");
  }
  const std::vector<std::string> addresses = addresses_in(arguments[1]);
  const std::size_t places = std::max(std::stoul(arguments[2]), 2 * kInserted);
  const std::size_t queries = std::stoul(arguments[3]);
  use_fleet_maps();
  Drives drives(arguments[0]);
  if (addresses.size() > 1) return run_shards(drives, addresses, places, queries);
  run_one(drives, addresses.front(), places, queries);
}

}  // namespace

int main(int argc, char** argv) {
  return loopbit::bench::run_main("bench_search", [&] { run({argv + 1, argv + argc}); });
}
