// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// How retrieval grows with the map: see scripts/bench_retrieval.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <faiss/IndexBinaryFlat.h>
#include <fmt/core.h>
#include <opencv2/core.hpp>

#include "loopbit/instruction_set.hpp"
#include "loopbit/place_index.hpp"

#include "long_sequence.hpp"
#include "measure.hpp"

namespace {

using namespace loopbit;         // NOLINT(google-build-using-namespace)
using namespace loopbit::bench;  // NOLINT(google-build-using-namespace)
using Clock = std::chrono::steady_clock;

/// Each query is asked so often, and its least time counts: other programs share the machine.
constexpr int kRepetitions = 5;
constexpr std::size_t kQueries = 100;  ///< of each kind
constexpr std::size_t kScans = 3;      ///< full scans that are timed
/// A frame of a run is no candidate for the next 10 s.
constexpr PlaceId kExclusion = 300;
constexpr std::size_t kFramesTimed = 50;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Memory of this process that no file backs, in bytes.
double anonymous_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("RssAnon:", 0) == 0) return 1024.0 * std::stod(line.substr(8));
  }
  throw std::runtime_error("there is no RssAnon in /proc/self/status");
}

/// The time of each call of add(), in steps of 10 ns up to 1 ms.
class AddTimes {
 public:
  void record(Clock::time_point start) {
    const auto steps =
        static_cast<std::size_t>((Clock::now() - start) / std::chrono::nanoseconds(10));
    ++counts_[std::min(steps, counts_.size() - 1)];
    ++total_;
    longest_us_ = std::max(longest_us_, static_cast<double>(steps) / 100);
  }
  [[nodiscard]] double percentile_us(double fraction) const {
    double left = fraction * static_cast<double>(total_);
    std::size_t step = 0;
    while (step + 1 < counts_.size() && (left -= static_cast<double>(counts_[step])) > 0) ++step;
    return static_cast<double>(step) / 100;
  }
  [[nodiscard]] double longest_us() const { return longest_us_; }

 private:
  std::vector<std::size_t> counts_ = std::vector<std::size_t>(100'000);
  std::size_t total_ = 0;
  double longest_us_ = 0;
};

struct Asked {
  std::vector<double> ms;             ///< the fastest asking of each query
  std::vector<double> first_wall_ms;  ///< the first one, with what had to be read from a disk
  RetrievalWork mean;
};

Asked ask(const PlaceIndex& index, const std::vector<BinaryContent>& queries) {
  Asked asked;
  for (const BinaryContent& query : queries) {
    double best_ms = 1e9;
    RetrievalWork work;
    for (int i = 0; i < kRepetitions; ++i) {
      const auto start = Clock::now();
      const double start_ms = thread_ms();
      static_cast<void>(index.query(query, index.size(), {}, &work));
      if (i == 0) asked.first_wall_ms.push_back(ms_since(start));
      best_ms = std::min(best_ms, thread_ms() - start_ms);
    }
    asked.ms.push_back(best_ms);
    const auto n = static_cast<std::int64_t>(queries.size());
    asked.mean.coarse_stretches += work.coarse_stretches / n;
    for (std::size_t level = 0; level < work.stretches.size(); ++level) {
      asked.mean.stretches[level] += work.stretches[level] / n;
    }
    asked.mean.contents += work.contents / n;
  }
  return asked;
}

/// What a query costs without any bound: the same kernel on every content, and the best by xi.
double full_scan_ms(const PlaceIndex& index, const std::vector<BinaryContent>& queries) {
  const RetrievalOptions options;
  std::vector<double> times;
  for (std::size_t scan = 0; scan < kScans; ++scan) {
    const BinaryContent& query = queries[scan];
    const double start_ms = thread_ms();
    const std::vector<BinaryContent> shifted =
        tolerated_shifts(query, options.shift_tolerance_columns);
    double best = 0;
    for (PlaceId place = 0; place < index.size(); ++place) {
      std::uint16_t overlap = 0;
      const BinaryContent& content = index.content(place);
      max_overlaps(shifted, std::span(&content, 1), std::span(&overlap, 1));
      best = std::max(best, static_cast<double>(overlap));
    }
    times.push_back(thread_ms() - start_ms);
    const double xi = best / count(query);
    const auto answer = index.query(query, index.size());
    if (!answer.empty() && answer.front().similarity > xi) throw std::logic_error("not exact");
  }
  return percentile(times, 0.5);
}

struct Queries {
  std::vector<BinaryContent> revisits;
  std::vector<BinaryContent> new_places;
};

Queries make_queries(const LongSequence& map, const LongSequence& elsewhere, std::size_t places) {
  Queries queries;
  const std::size_t key_frames = places / LongSequence::kFramesPerKeyFrame;
  for (std::size_t i = 0; i < kQueries; ++i) {
    queries.revisits.push_back(map.revisit(i * 7'919 % key_frames));
    queries.new_places.push_back(elsewhere.key_frame(i * 37));
  }
  return queries;
}

struct Row {
  std::size_t places = 0;
  double p50_ms = 0, p99_ms = 0, full_scan_ms = 0, faiss_ms = 0, bytes_per_place = 0,
         add_p99_us = 0;
};

void print_kind(const char* kind, std::size_t places, const Asked& asked) {
  fmt::print(
      "  {} places={} p50_ms={:.3f} p99_ms={:.3f} coarse_32={} bounds_32={} bounds_16={} "
      "bounds_8={} bounds_2={} contents={}\n",
      kind, places, percentile(asked.ms, 0.5), percentile(asked.ms, 0.99),
      asked.mean.coarse_stretches, asked.mean.stretches[0], asked.mean.stretches[1],
      asked.mean.stretches[2], asked.mean.stretches[3], asked.mean.contents);
}

void measure(const PlaceIndex& index, const Queries& queries, bool on_disk, Row& row) {
  const Asked revisits = ask(index, queries.revisits);
  const Asked new_places = ask(index, queries.new_places);
  std::vector<double> all = revisits.ms;
  all.insert(all.end(), new_places.ms.begin(), new_places.ms.end());
  row.p50_ms = percentile(all, 0.5);
  row.p99_ms = percentile(all, 0.99);
  print_kind("revisits", row.places, revisits);
  print_kind("new_places", row.places, new_places);
  if (on_disk) {
    std::vector<double> first = revisits.first_wall_ms;
    first.insert(first.end(), new_places.first_wall_ms.begin(), new_places.first_wall_ms.end());
    fmt::print("  first_asking places={} wall_p50_ms={:.2f} wall_p99_ms={:.2f}\n", row.places,
               percentile(first, 0.5), percentile(first, 0.99));
  } else {
    row.full_scan_ms = full_scan_ms(index, queries.revisits);
  }
}

/// How alike frames of the sequence are that lie `apart`: the mean xi of 1,000 pairs.
double mean_similarity(const PlaceIndex& index, PlaceId apart) {
  constexpr PlaceId kPairs = 1'000;
  double sum = 0;
  for (PlaceId pair = 0; pair < kPairs; ++pair) {
    const PlaceId place = (index.size() - apart) / kPairs * pair;
    sum += similarity(index.content(place), index.content(place + apart), 4);
  }
  return sum / kPairs;
}

/// The next frames of the run, each asked before it is added, as the detector does.
void time_frames(PlaceIndex& index, LongSequence& sequence) {
  double total_ms = 0;
  for (std::size_t i = 0; i < kFramesTimed; ++i) {
    const BinaryContent content = sequence.next();
    const double start_ms = thread_ms();
    static_cast<void>(index.query(content, index.size() - kExclusion));
    index.add(content);
    total_ms += thread_ms() - start_ms;
  }
  fmt::print("  frame places={} retrieval_ms={:.3f}\n", index.size(), total_ms / kFramesTimed);
}

bool is_of_curve(std::size_t places) {
  if (places < 1'000) return false;
  while (places % 10 == 0) places /= 10;
  return places == 1 || places == 2 || places == 5;
}

std::vector<Row> grow(const std::vector<std::size_t>& sizes, LongSequence& map,
                      const LongSequence& elsewhere, const std::string& folder) {
  std::vector<Row> rows;
  const double before = anonymous_bytes();
  PlaceIndex index = folder.empty() ? PlaceIndex() : PlaceIndex(folder);
  AddTimes add_times;
  const auto start = Clock::now();
  double adding_ms = 0;
  for (const std::size_t size : sizes) {
    while (static_cast<std::size_t>(index.size()) < size) {
      const BinaryContent content = map.next();
      const auto added = Clock::now();
      index.add(content);
      add_times.record(added);
      adding_ms += ms_since(added);
      if (is_of_curve(static_cast<std::size_t>(index.size()))) time_frames(index, map);
    }
    Row row{.places = size};
    row.bytes_per_place = (anonymous_bytes() - before) / static_cast<double>(index.size());
    row.add_p99_us = add_times.percentile_us(0.99);
    fmt::print(
        "  build places={} adding_s={:.2f} with_making_contents_s={:.1f} add_p50_us={:.2f} "
        "add_longest_us={:.0f}\n",
        size, adding_ms / 1e3, ms_since(start) / 1e3, add_times.percentile_us(0.5),
        add_times.longest_us());
    fmt::print("  sequence places={} xi_1_apart={:.3f} xi_16_apart={:.3f}\n", size,
               mean_similarity(index, 1), mean_similarity(index, 16));
    measure(index, make_queries(map, elsewhere, size), !folder.empty(), row);
    std::fflush(stdout);
    rows.push_back(row);
  }
  return rows;
}

void print_hard(const char* kind, const PlaceIndex& index,
                const std::vector<BinaryContent>& queries) {
  const Asked asked = ask(index, queries);
  fmt::print("  hard {} places={} p50_ms={:.3f} p99_ms={:.3f} full_scan_ms={:.2f} contents={}\n",
             kind, index.size(), percentile(asked.ms, 0.5), percentile(asked.ms, 0.99),
             full_scan_ms(index, queries), asked.mean.contents);
}

BinaryContent random_content(cv::RNG& random) {
  BinaryContent content;
  // Two in nine pixels are set, as in contents of images.
  for (std::uint64_t& row : content.rows) {
    for (int x = 0; x < kContentSide; ++x) {
      row |= static_cast<std::uint64_t>(random.uniform(0, 9) < 2) << static_cast<unsigned>(x);
    }
  }
  return content;
}

/// Maps whose places are bounded badly: neighbours that are not alike.
void measure_hard_maps(const LongSequence& map, const LongSequence& elsewhere) {
  constexpr std::size_t kPlaces = 100'000;
  std::vector<BinaryContent> queries;
  PlaceIndex far_apart;
  for (std::size_t i = 0; i < kPlaces; ++i) far_apart.add(map.key_frame_of_lap(i));
  for (std::size_t i = 0; i < kQueries; ++i) queries.push_back(elsewhere.key_frame(i * 37));
  print_hard("new_places_in_key_frames_only", far_apart, queries);

  cv::RNG random(2019);
  PlaceIndex noise;
  for (std::size_t i = 0; i < kPlaces; ++i) noise.add(random_content(random));
  queries.clear();
  for (std::size_t i = 0; i < 10; ++i) queries.push_back(random_content(random));
  print_hard("random_bits", noise, queries);
}

/// The same places and queries in IndexBinaryFlat: Hamming distance, no shifts, as many nearest as
/// there are candidates.
void run_faiss(LongSequence& map, const LongSequence& elsewhere, std::vector<Row>& rows) {
  faiss::IndexBinaryFlat index(8 * sizeof(BinaryContent));
  index.xb.reserve(rows.back().places * sizeof(BinaryContent));
  map.restart();
  for (Row& row : rows) {
    while (static_cast<std::size_t>(index.ntotal) < row.places) {
      const BinaryContent content = map.next();
      index.add(1, reinterpret_cast<const std::uint8_t*>(content.rows.data()));
    }
    const Queries queries = make_queries(map, elsewhere, row.places);
    std::vector<double> times;
    for (std::size_t i = 0; i < 2 * kScans; ++i) {
      const BinaryContent& query = i % 2 == 0 ? queries.revisits[i] : queries.new_places[i];
      constexpr int kNearest = RetrievalOptions{}.max_candidates;
      std::vector<std::int32_t> distances(kNearest);
      std::vector<faiss::IndexBinary::idx_t> places(kNearest);
      const double start_ms = thread_ms();
      index.search(1, reinterpret_cast<const std::uint8_t*>(query.rows.data()), kNearest,
                   distances.data(), places.data());
      times.push_back(thread_ms() - start_ms);
    }
    row.faiss_ms = percentile(times, 0.5);
  }
}

/// bench_retrieval DATA FOLDER SIZE ...: see the script.
void run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) throw std::runtime_error("usage: bench_retrieval DATA FOLDER SIZE ...");
  std::vector<std::size_t> sizes;
  for (auto size = arguments.begin() + 2; size != arguments.end(); ++size) {
    sizes.push_back(std::stoul(*size));
  }
  std::sort(sizes.begin(), sizes.end());
  const std::string& data = arguments[0];
  LongSequence map(data, {"kitti03", "office_tour", "lateral_corridor"}, 21, 6);
  const LongSequence elsewhere(data, {"euroc_room"}, 91, 1);
  std::vector<Row> rows = grow(sizes, map, elsewhere, arguments[1]);
  if (arguments[1].empty()) {
    measure_hard_maps(map, elsewhere);
    run_faiss(map, elsewhere, rows);
  }
  for (const Row& row : rows) {
    fmt::print(
        "places={} p50_ms={:.3f} p99_ms={:.3f} full_scan_ms={:.2f} faiss_ms={:.2f} "
        "bytes_per_place={:.1f} add_p99_us={:.2f}\n",
        row.places, row.p50_ms, row.p99_ms, row.full_scan_ms, row.faiss_ms, row.bytes_per_place,
        row.add_p99_us);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return loopbit::bench::run_main("bench_retrieval", [&] { run({argv + 1, argv + argc}); });
}
