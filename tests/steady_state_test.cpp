// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A program of its own, because it counts every allocation, and refuses some.
#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>

#include <gtest/gtest.h>

#include "loopbit/loop_detector.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "test_support.hpp"

namespace {

std::atomic<int> allocations = 0;
std::atomic<int> refused = -1;  ///< the number of the allocation that is refused

}  // namespace

void* operator new(std::size_t size) {
  if (allocations++ == refused) throw std::bad_alloc();
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

TEST(RefusedMemory, WhicheverItIsLeavesTheDetectorAsItWas) {
  LoopDetectorOptions options;
  options.surf = {.working_area_px = 160 * 120, .max_keypoints = 100};
  options.decision.min_score = 5;
  options.decision.full_steps = 1;
  LoopDetector undisturbed(options);
  LoopDetector detector(options);
  constexpr int kLap = 14;
  int loops = 0;
  for (int frame = 0; frame < 2 * kLap; ++frame) {
    const cv::Mat1b image = view(frame % kLap);
    const Detection expected = undisturbed.process(image);
    loops += expected.status == Status::loop ? 1 : 0;
    std::optional<Detection> found;
    for (int n = 0; !found; ++n) {
      refused = allocations + n;
      try {
        found = detector.process(image);
      } catch (const std::bad_alloc&) {
        ASSERT_EQ(detector.size(), frame) << "allocation " << n;
      }
      refused = -1;
    }
    ASSERT_EQ(found->status, expected.status);
    ASSERT_EQ(found->match, expected.match);
    ASSERT_EQ(found->score, expected.score);
  }
  EXPECT_GT(loops, 5);
}

}  // namespace
}  // namespace loopbit::test
