// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A program of its own, because it counts every allocation, and refuses some.
#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>

#include <gtest/gtest.h>

#include "loopbit/loop_detector.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "test_support.hpp"

namespace {

std::atomic<int> allocations = 0;
thread_local int left_until_refused = -1;  ///< allocations of this thread; -1 = none is refused

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (left_until_refused >= 0 && left_until_refused-- == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;  // NOLINT(cppcoreguidelines-no-malloc)
  throw std::bad_alloc();
}

void* operator new[](std::size_t size) { return operator new(size); }

void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  return std::malloc(size);  // NOLINT(cppcoreguidelines-no-malloc)
}

// Inlined where `new` is not, GCC takes them for no pair.
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);  // NOLINT(cppcoreguidelines-no-malloc)
}

void operator delete(void* memory, std::size_t /*size*/) noexcept { operator delete(memory); }

void operator delete[](void* memory) noexcept { operator delete(memory); }

void operator delete[](void* memory, std::size_t /*size*/) noexcept { operator delete(memory); }

namespace loopbit::test {
namespace {

TEST(SteadyState, CountsAllocations) {
  const int before = allocations;
  const auto memory = std::make_unique<int>(1);
  EXPECT_EQ(allocations, before + 1);
}

TEST(SteadyState, FeaturesOfImagesOfOneSizeAllocateNothing) {
  for (const bool upright : {true, false}) {
    SurfExtractor extractor({.working_area_px = 320 * 240, .upright = upright});
    Features features;
    const cv::Mat1b images[] = {view(1), view(2), view(3)};
    for (const cv::Mat1b& image : images) extractor.extract(image, features);
    const int before = allocations;
    for (const cv::Mat1b& image : images) extractor.extract(image, features);
    EXPECT_EQ(allocations, before);
  }
}

TEST(SteadyState, VerificationAllocatesNothing) {
  Verifier verifier;
  Verification result;
  const Features query = extract_surf(view(1));
  const Features places[] = {extract_surf(view(1, {12, 5})), extract_surf(view(2)), Features{}};
  int before = 0;
  for (int round = 0; round < 2; ++round) {
    before = allocations;
    for (const Features& place : places) {
      verifier.match(query, place, result);
      verifier.find_geometry(query, place, result);
    }
  }
  EXPECT_EQ(allocations, before);
}

/// The `n`-th allocation of this thread is refused while it lives.
class Refusal {
 public:
  explicit Refusal(int n) { left_until_refused = n; }
  ~Refusal() { left_until_refused = -1; }
  Refusal(const Refusal&) = delete;
  Refusal& operator=(const Refusal&) = delete;
  Refusal(Refusal&&) = delete;
  Refusal& operator=(Refusal&&) = delete;
};

LoopDetectorOptions small_options() {
  LoopDetectorOptions options;
  options.surf = {.working_area_px = 160 * 120, .max_keypoints = 100};
  options.decision.min_score = 0.001;  // few features in a small map are little evidence
  return options;
}

/// Of two laps, in which `detector` is refused each allocation of each frame in turn.
void expect_same_answers(LoopDetector& detector, LoopDetector& undisturbed) {
  constexpr int kLap = 14;
  int loops = 0;
  for (int frame = 0; frame < 2 * kLap; ++frame) {
    const cv::Mat1b image = view(frame % kLap);
    const Detection expected = undisturbed.process(image);
    loops += expected.status == Status::loop ? 1 : 0;
    std::optional<Detection> found;
    for (int n = 0; !found; ++n) {
      try {
        const Refusal refusal(n);
        found = detector.process(image);
      } catch (const std::bad_alloc&) {
        ASSERT_EQ(detector.size(), frame) << "allocation " << n;
      }
    }
    ASSERT_EQ(found->status, expected.status);
    ASSERT_EQ(found->match, expected.match);
    ASSERT_EQ(found->score, expected.score);
  }
  EXPECT_GT(loops, 5);
}

using RefusedMemory = ScratchTest;

TEST_F(RefusedMemory, WhicheverItIsLeavesTheDetectorAsItWas) {
  LoopDetector undisturbed(small_options());
  LoopDetector detector(small_options());
  expect_same_answers(detector, undisturbed);
}

TEST_F(RefusedMemory, WhicheverItIsLeavesTheMapAsItWas) {
  const LoopDetectorOptions options = small_options();
  const auto map = std::make_shared<MapWriter>(path("map.db"), options, "refused");
  LoopDetector undisturbed(options);
  LoopDetector detector(options, map);
  expect_same_answers(detector, undisturbed);
  map->finish();
  const MapCheck check = check_map(path("map.db"));
  EXPECT_EQ(check.places, undisturbed.size());
  EXPECT_TRUE(check.damage.empty());
}

}  // namespace
}  // namespace loopbit::test
