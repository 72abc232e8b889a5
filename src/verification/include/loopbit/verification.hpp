// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/camera.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/options.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// Two features that may show the same point of the world.
struct Match {
  int query = 0;  ///< index into the query's features
  int place = 0;  ///< index into the place's features

  bool operator==(const Match&) const = default;
};

struct VerificationOptions {
  int first_look_keypoints = 300;
  int max_closer_looks = 5;
  double max_ratio = 0.8;
  int min_matches = 8;
  double max_epipolar_error_px = 2.0;
  double min_spacing_scales = 10.0;

  static constexpr auto fields() {
    using S = VerificationOptions;
    return std::tuple{
        Field{"first_look_keypoints", &S::first_look_keypoints, 16, 10000,
              "strongest keypoints per image, matched first to choose candidates for a full match"},
        Field{"max_closer_looks", &S::max_closer_looks, 1, 1'000'000,
              "candidates matched in full; others only if they seem to share features with these"},
        Field{"max_ratio", &S::max_ratio, 0.1, 1.0,
              "a match is kept if its distance is below this share of the second-best distance"},
        Field{"min_matches", &S::min_matches, 8, 1000,
              "with fewer matches no geometry is computed"},
        Field{"max_epipolar_error_px", &S::max_epipolar_error_px, 0.1, 50.0,
              "largest Sampson distance of an inlier from the geometry, working pixels"},
        Field{"min_spacing_scales", &S::min_spacing_scales, 0.0, 100.0,
              "inliers closer than this many scales count as one; a descriptor spans 20"}};
  }
};

/// The matches and inliers of two images.
struct Verification {
  std::vector<Match> matches;  ///< one to one
  std::vector<Match> inliers;  ///< matches that fit one epipolar geometry
  int distinct_inliers = 0;    ///< see distinct_inliers()
  double explained_share = 0;  ///< see explained_share()
};

/// The matches of the strongest features of two images, and intermediate results that a full match
/// reuses. 4 KB for 300 of 600 features.
struct FirstLook {
  /// The nearest neighbour of a feature, and the squared distances of it and of the next one.
  struct Neighbours {
    std::int32_t index = 0;
    std::int32_t distance_sq = 0;
    std::int32_t second_distance_sq = 0;
  };
  /// Features with one sign of the Laplacian.
  struct Group {
    std::size_t num_query = 0;        ///< number of strongest features of the query
    std::size_t num_place = 0;        ///< number of features of the place they were compared with
    std::vector<Neighbours> nearest;  ///< of the query's features, in order
  };

  std::vector<Match> matches;  ///< one to one
  Group dark;
  Group bright;
};

/// Mutual best matches by descriptor distance that pass the ratio test from both sides. Only
/// features with the same sign of the Laplacian are compared. Each feature is in at most one match,
/// because one-way matches pile up on few points and look like inliers. Equally near features are
/// ambiguous and do not match. A feature without a second-best neighbour passes the ratio test.
/// Cost: about half of (query features x place features) in one direction, and half of (matches x
/// query features) back. No distances are stored.
std::vector<Match> match_features(const Features& query, const Features& place, double max_ratio);

/// The largest set of `matches` that fits one epipolar geometry, found by RANSAC with a fixed seed,
/// or that did not move at all. Empty below 8 matches, because 7 always fit. The same input gives
/// the same inliers.
///
/// `camera`: of both images, which are resized versions of it. The geometry is then an essential
/// matrix of rays, which every lens has; an error is an angle, of `max_error_px` at the keypoints.
/// Without a camera, or if the images differ in size, it is a fundamental matrix of pixels.
std::vector<Match> epipolar_inliers(const Features& query, const Features& place,
                                    const std::vector<Match>& matches, double max_error_px,
                                    const CameraModel* camera = nullptr);

/// Up to this many inliers are chance: one more than the matches that always have a geometry, which
/// are 7 for a fundamental matrix and 5 for an essential one.
int chance_inliers(const Features& query, const Features& place, const CameraModel* camera);

/// Counts the inliers that lie apart in both images, greedily in their order: at least
/// `min_spacing_scales` times the smaller scale of two keypoints. Keypoints with overlapping
/// patches see the same few pixels. A small object that exists in many places (a lamp, the end of a
/// zebra crossing) has many of them, so they are not independent evidence.
int distinct_inliers(const Features& query, const Features& place,
                     const std::vector<Match>& inliers, double min_spacing_scales);

/// The share of the query's features among the inliers that are inliers themselves, 0 to 1; 0
/// without inliers. "Among" means within the middle 80 % of the inliers' x and of their y. At a
/// true revisit the share is a tenth or more. If only a look-alike door matches, most features
/// around it do not. Cost: linear in the features.
double explained_share(const Features& query, const std::vector<Match>& inliers);

/// Step 3 for pairs of images, in two halves (matching and geometry), so that callers can skip the
/// second. It keeps its memory: after the largest pair it allocates only what `result` needs. Not
/// thread-safe; use one per thread.
class Verifier {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit Verifier(const VerificationOptions& options = {},
                    InstructionSet instruction_set = active_instruction_set());
  ~Verifier();
  Verifier(const Verifier&) = delete;
  Verifier& operator=(const Verifier&) = delete;
  Verifier(Verifier&&) noexcept;
  Verifier& operator=(Verifier&&) noexcept;

  /// Sets `result.matches` (see match_features) and clears the rest.
  void match(const Features& query, const Features& place, Verification& result);

  /// Matches only so many of the strongest features of each image, in a fraction of the time.
  void match_strongest(const Features& query, const Features& place, std::size_t strongest,
                       FirstLook& look);

  /// As match(), but reuses the result of match_strongest() for the same pair.
  void match(const Features& query, const Features& place, const FirstLook& look,
             Verification& result);

  /// Finds only the matches of the query's features `asked` (increasing indices). The time is
  /// proportional to their number.
  void match_some(const Features& query, std::span<const int> asked, const Features& place,
                  Verification& result);

  /// Sets the other fields from `result.matches`. Leaves them empty if there are fewer than
  /// min_matches. `camera`: see epipolar_inliers().
  void find_geometry(const Features& query, const Features& place, Verification& result,
                     const CameraModel* camera = nullptr);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Step 3 for one candidate: match_features, epipolar_inliers, distinct_inliers, explained_share.
Verification verify(const Features& query, const Features& place,
                    const VerificationOptions& options = {}, const CameraModel* camera = nullptr);

}  // namespace loopbit
