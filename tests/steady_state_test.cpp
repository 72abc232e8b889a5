// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A program of its own, because it counts every allocation.
#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "test_support.hpp"

namespace {

std::atomic<int> allocations = 0;

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;  // NOLINT(cppcoreguidelines-no-malloc)
  throw std::bad_alloc();
}

void* operator new[](std::size_t size) { return operator new(size); }

void operator delete(void* memory) noexcept {
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

}  // namespace
}  // namespace loopbit::test
