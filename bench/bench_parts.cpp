// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// What each part costs, on frames of the built-in world. Compare rows of one run with each other:
// kernels against the scalar one, bytes_per_second against the machine's bandwidth.
#include <cstdint>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include "loopbit/binary_content.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"
#include "loopbit/world.hpp"

namespace {

using namespace loopbit;  // NOLINT(google-build-using-namespace)

cv::Mat1b frame(int number) {
  static const World world{WorldOptions{}};
  return gray_image(world.render(number));
}

/// Places as a drive leaves them: each content is the one before, a little changed.
std::vector<BinaryContent> drive(std::size_t places) {
  std::vector<BinaryContent> contents{binary_content(frame(0))};
  std::uint64_t noise = 2019;
  while (contents.size() < places) {
    contents.push_back(shift_columns(contents.back(), contents.size() % 2 == 0 ? 1 : -1));
    for (std::uint64_t& row : contents.back().rows) {
      noise = noise * 6364136223846793005U + 1442695040888963407U;
      row ^= std::uint64_t{1} << (noise >> 58U);
    }
  }
  return contents;
}

void bm_binary_content(benchmark::State& state) {
  const cv::Mat1b image = frame(0);
  for (auto _ : state) benchmark::DoNotOptimize(binary_content(image));
}
BENCHMARK(bm_binary_content)->Unit(benchmark::kMicrosecond);

/// A full scan with five shifts, by each instruction set of this processor.
void bm_max_overlaps(benchmark::State& state) {
  const InstructionSet set = available_instruction_sets()[static_cast<std::size_t>(state.range(0))];
  constexpr std::size_t kPlaces = 10'000;
  constexpr std::size_t kShifts = 5;
  const auto contents = drive(kPlaces);
  std::vector<std::uint16_t> overlaps(kPlaces);
  for (auto _ : state) {
    max_overlaps(std::span(contents).first(kShifts), contents, overlaps, set);
    benchmark::DoNotOptimize(overlaps.data());
  }
  state.SetLabel(std::string(to_string(set)));
  state.SetBytesProcessed(state.iterations() *
                          static_cast<std::int64_t>(kPlaces * sizeof(BinaryContent)));
}
BENCHMARK(bm_max_overlaps)
    ->DenseRange(0, static_cast<std::int64_t>(available_instruction_sets().size()) - 1)
    ->Unit(benchmark::kMicrosecond);

void bm_query(benchmark::State& state) {
  PlaceIndex index;
  for (const BinaryContent& content : drive(static_cast<std::size_t>(state.range(0)))) {
    index.add(content);
  }
  const BinaryContent query = index.content(index.size() / 2);
  for (auto _ : state) benchmark::DoNotOptimize(index.query(query, index.size()));
}
BENCHMARK(bm_query)->Arg(1'000)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMicrosecond);

void bm_extract_surf(benchmark::State& state) {
  const cv::Mat1b image = frame(0);
  for (auto _ : state) benchmark::DoNotOptimize(extract_surf(image));
}
BENCHMARK(bm_extract_surf)->Unit(benchmark::kMillisecond);

void bm_match_features(benchmark::State& state) {
  const Features query = extract_surf(frame(180));
  const Features place = extract_surf(frame(2));
  for (auto _ : state) benchmark::DoNotOptimize(match_features(query, place, 0.8));
}
BENCHMARK(bm_match_features)->Unit(benchmark::kMicrosecond);

void bm_verify(benchmark::State& state) {
  const Features query = extract_surf(frame(180));
  const Features place = extract_surf(frame(2));
  for (auto _ : state) benchmark::DoNotOptimize(verify(query, place));
}
BENCHMARK(bm_verify)->Unit(benchmark::kMicrosecond);

}  // namespace
