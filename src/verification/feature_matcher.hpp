// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "loopbit/kernels.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// match_features() with memory that is kept from pair to pair.
class FeatureMatcher {
 public:
  explicit FeatureMatcher(const Kernels& kernels) : kernels_(kernels) {}

  /// Of `query` and `place`, about so many of the strongest features take part.
  void match(const Features& query, const Features& place, double max_ratio, std::size_t strongest,
             std::vector<Match>& matches);

  /// Of the matches of all features, those of the query's features `asked`, in rising order.
  void match_some(const Features& query, std::span<const int> asked, const Features& place,
                  double max_ratio, std::vector<Match>& matches);

 private:
  using Descriptors = std::span<const Descriptor>;

  void match_group(Descriptors query, std::span<const int> asked, Descriptors place,
                   double max_ratio);
  void find_one_way(Descriptors query, std::span<const int> asked, Descriptors place,
                    double max_ratio);
  void keep_mutual(Descriptors query, Descriptors place, double max_ratio);
  void append_bright(const Features& query, const Features& place,
                     std::vector<Match>& matches) const;
  void find_constants(Descriptors descriptors);

  const Kernels& kernels_;
  std::vector<std::int32_t> constants_;
  std::vector<int> asked_;      ///< of one group, numbered from its first descriptors
  std::vector<Match> matches_;  ///< so, too
};

}  // namespace loopbit
