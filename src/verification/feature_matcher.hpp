// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "loopbit/kernels_for.hpp"
#include "loopbit/verification.hpp"

#include "match_kernels.hpp"

namespace loopbit {

/// Matches pairs of images; keeps its memory from pair to pair.
class FeatureMatcher {
 public:
  explicit FeatureMatcher(InstructionSet instruction_set)
      : kernels_(kernels_for<MatchKernels>(instruction_set)) {}

  /// As match_features(). `look`: of match_strongest() for the same pair, or empty.
  void match(const Features& query, const Features& place, double max_ratio, const FirstLook& look,
             std::vector<Match>& matches);

  /// Of `query` and `place`, so many of the strongest features take part at most.
  void match_strongest(const Features& query, const Features& place, double max_ratio,
                       std::size_t strongest, FirstLook& look);

  /// Of the matches of all features, those of the query's features `asked`, in rising order.
  void match_some(const Features& query, std::span<const int> asked, const Features& place,
                  double max_ratio, std::vector<Match>& matches);

 private:
  using Descriptors = std::span<const Descriptor>;

  void match_group(Descriptors query, std::span<const int> asked, Descriptors place,
                   double max_ratio, FirstLook::Group* noted = nullptr);
  void match_rest(Descriptors query, Descriptors place, double max_ratio,
                  const FirstLook::Group& known);
  void find_one_way(Descriptors query, std::span<const int> asked, Descriptors place,
                    double max_ratio, FirstLook::Group* noted);
  void keep_distinct(std::span<const int> asked, const NearestTwo& nearest, double max_ratio);
  void keep_mutual(Descriptors query, Descriptors place, double max_ratio);
  void append_bright(const Features& query, const Features& place,
                     std::vector<Match>& matches) const;
  std::span<const int> first_numbers(std::size_t count);
  void find_constants(Descriptors descriptors);
  void find_nearest(Descriptors query, std::span<const int> asked, Descriptors place,
                    NearestTwo& nearest) const;

  const MatchKernels& kernels_;
  std::vector<std::int32_t> constants_;
  std::vector<int> asked_;      ///< of one group, numbered from its first descriptors
  std::vector<Match> matches_;  ///< of one group, numbered likewise
};

}  // namespace loopbit
