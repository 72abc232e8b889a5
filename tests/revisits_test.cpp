// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/revisits.hpp"

#include <gtest/gtest.h>

namespace loopbit {
namespace {

TEST(Revisits, LoopsInARowAreOneRevisit) {
  MatchList list;
  for (int i = 0; i <= 110; i += 2) list.matches.push_back({300 + i, 46 + i * 104 / 110, 20, true});
  list.matches.push_back({301, 46, 5, false});   // a candidate that was not accepted
  list.matches.push_back({351, 200, 15, true});  // in the middle, elsewhere
  for (int i = 0; i < 5; ++i) list.matches.push_back({500 + i, 90 - i, 20, true});  // in reverse
  EXPECT_EQ(revisits(list),
            (std::vector<Revisit>{
                {300, 410, 46, 150, 56}, {351, 351, 200, 200, 1}, {500, 504, 90, 86, 5}}));
}

TEST(Revisits, AGapOfMoreThanTwentyFramesBeginsANewOne) {
  const MatchList list{{{400, 70, 9, true},
                        {420, 90, 9, true},
                        {441, 111, 9, true},
                        {461, 160, 9, true},
                        {461, 131, 9, true}},
                       {}};
  EXPECT_EQ(revisits(list),
            (std::vector<Revisit>{
                {400, 420, 70, 90, 2}, {441, 461, 111, 131, 2}, {461, 461, 160, 160, 1}}));
  EXPECT_TRUE(revisits({}).empty());
}

}  // namespace
}  // namespace loopbit
