// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/kernels.hpp"
#include "loopbit/options.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// Two features taken for the same point of the world.
struct Match {
  int query = 0;  ///< index into the query's features
  int place = 0;  ///< index into the place's features

  bool operator==(const Match&) const = default;
};

struct VerificationOptions {
  int first_look_keypoints = 400;
  int max_closer_looks = 3;
  double max_ratio = 0.85;
  int min_matches = 8;
  double max_epipolar_error_px = 2.0;
  double min_spacing_scales = 10.0;

  static constexpr auto fields() {
    using S = VerificationOptions;
    return std::tuple{
        Field{"first_look_keypoints", &S::first_look_keypoints, 16, 10000,
              "strongest keypoints of either image that tell which candidates to look at closer"},
        Field{"max_closer_looks", &S::max_closer_looks, 1, 1'000'000,
              "likeliest candidates whose keypoints are all matched, and their geometry sought"},
        Field{"max_ratio", &S::max_ratio, 0.1, 1.0,
              "a match is kept if its distance is less than this part of the second best"},
        Field{"min_matches", &S::min_matches, 8, 1000, "with fewer matches no geometry is sought"},
        Field{"max_epipolar_error_px", &S::max_epipolar_error_px, 0.1, 50.0,
              "an inlier lies at most this far (Sampson's distance) from the geometry, working "
              "pixels"},
        Field{"min_spacing_scales", &S::min_spacing_scales, 0.0, 100.0,
              "inliers closer than this are one piece of evidence; a descriptor spans 20 scales"}};
  }
};

/// What the geometry of two images says about them showing one place.
struct Verification {
  std::vector<Match> matches;  ///< one to one
  std::vector<Match> inliers;  ///< those that one epipolar geometry explains
  int distinct_inliers = 0;    ///< see distinct_inliers()
  double explained_share = 0;  ///< see explained_share()
};

/// What the strongest features of two images have in common, and what a full match of the two need
/// not find again. Of 600 features each, of which 300 are strongest, 6 KB.
struct FirstLook {
  /// Features with one sign of the Laplacian.
  struct Group {
    std::size_t num_query = 0;  ///< strongest features of the query ...
    std::size_t num_place = 0;  ///< ... whose neighbours were sought among so many of the place
    std::vector<NearestTwo> nearest;  ///< of kMatchLanes features each, in order
  };

  std::vector<Match> matches;  ///< one to one
  Group dark;
  Group bright;
};

/// Mutual best matches by the distance of descriptors that pass the ratio test from either side;
/// only features with the same sign of the Laplacian are compared. Each feature is in one match at
/// most: one-way matches gather on few points and fake inliers. Equally near features are ambiguous
/// and match nothing. A feature that has nothing to be second to is distinct. Cost: half of
/// query times place features from one side, and the matches found times half the query's back;
/// no distance is kept.
std::vector<Match> match_features(const Features& query, const Features& place, double max_ratio);

/// The largest set of `matches` found that one fundamental matrix explains, by RANSAC with a fixed
/// seed, or that did not move at all; empty below 8 matches, as 7 always fit. The same input gives
/// the same inliers.
std::vector<Match> epipolar_inliers(const Features& query, const Features& place,
                                    const std::vector<Match>& matches, double max_error_px);

/// How many of `inliers`, first come first served, lie apart from each other in both images: at
/// least `min_spacing_scales` times the smaller of two keypoints' scales. Keypoints whose patches
/// overlap see the same few pixels, and a small thing seen everywhere (a lamp, the end of a zebra
/// crossing) has many of them, so they are not independent evidence.
int distinct_inliers(const Features& query, const Features& place,
                     const std::vector<Match>& inliers, double min_spacing_scales);

/// The part of the query's features amid `inliers` that are inliers themselves, 0 to 1; 0 without
/// any. Amid: within the middle 80 % of the inliers' x and of their y. Of a place seen again, a
/// tenth or more is found again; where only a door of the same make was found, most of what
/// surrounds it is left unexplained. Cost: linear in the features.
double explained_share(const Features& query, const std::vector<Match>& inliers);

/// Step 3 for one pair after another in two halves, so that the second can be left out. Its memory
/// is kept: once it has seen the largest pair, nothing is allocated but what `result` lacks. Not
/// thread-safe; use one a thread.
class Verifier {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit Verifier(const VerificationOptions& options = {},
                    const Kernels& kernels = active_kernels());
  ~Verifier();
  Verifier(const Verifier&) = delete;
  Verifier& operator=(const Verifier&) = delete;
  Verifier(Verifier&&) noexcept;
  Verifier& operator=(Verifier&&) noexcept;

  /// Sets `result.matches` (see match_features) and clears the rest.
  void match(const Features& query, const Features& place, Verification& result);

  /// The same for the strongest `first_look_keypoints` features of each, in a fraction of the time.
  void match_strongest(const Features& query, const Features& place, FirstLook& look);

  /// As match(), after match_strongest() of the same pair, whose neighbours are not sought again.
  void match(const Features& query, const Features& place, const FirstLook& look,
             Verification& result);

  /// Of what match() finds, the matches of the query's features `asked` (indices, rising), in the
  /// time of so many features.
  void match_some(const Features& query, std::span<const int> asked, const Features& place,
                  Verification& result);

  /// Sets the rest from `result.matches`; leaves it empty where they are fewer than min_matches.
  void find_geometry(const Features& query, const Features& place, Verification& result);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Step 3 for one candidate: match_features, epipolar_inliers, distinct_inliers, explained_share.
Verification verify(const Features& query, const Features& place,
                    const VerificationOptions& options = {});

}  // namespace loopbit
