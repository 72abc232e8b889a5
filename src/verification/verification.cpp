// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/verification.hpp"

#include <algorithm>
#include <cmath>

#include "epipolar_ransac.hpp"
#include "feature_matcher.hpp"

namespace loopbit {
namespace {

/// Seven matches always have a fundamental matrix, so only more can speak for one. It also leads to
/// the essential matrix, which five matches always have.
constexpr std::size_t kMinMatchesForGeometry = 8;
constexpr int kChanceInliersOfPixels = 8;
constexpr int kChanceInliersOfRays = 6;

/// Whether the geometry of two images is one of rays.
bool has_rays(const Features& query, const Features& place, const CameraModel* camera) {
  return camera != nullptr && query.working_size_px == place.working_size_px;
}

EpipolarRansac::Pair pair_of(const Features& query, const Features& place, const Match& match) {
  const Keypoint& a = query.keypoint(match.query);
  const Keypoint& b = place.keypoint(match.place);
  return {a.x_px, a.y_px, b.x_px, b.y_px};
}

/// Of zeros where the lens has no ray; such pairs are no inliers of any geometry.
ViewRay ray_of(const CameraModel& camera, const Keypoint& keypoint) {
  cv::Matx32d turn;
  const auto ray = unproject(camera, {keypoint.x_px, keypoint.y_px}, &turn);
  if (!ray) return {};
  const double area = cv::norm(cv::Vec3d(turn.col(0).val).cross(cv::Vec3d(turn.col(1).val)));
  return {cv::Vec3f(*ray), static_cast<float>(area)};
}

float moved_px(const EpipolarRansac::Pair& pair) {
  return std::hypot(pair.x1 - pair.x0, pair.y1 - pair.y0);
}

bool overlap(const Keypoint& a, const Keypoint& b, double min_spacing_scales) {
  const double dx = a.x_px - b.x_px;
  const double dy = a.y_px - b.y_px;
  const double spacing = min_spacing_scales * std::min(a.scale, b.scale);
  return dx * dx + dy * dy < spacing * spacing;
}

struct Range {
  float min = 0;
  float max = 0;

  [[nodiscard]] bool contains(float value) const { return min <= value && value <= max; }
};

/// The middle 80 % of `values`, which it puts in another order.
Range middle(std::vector<float>& values) {
  const auto tenth = static_cast<std::ptrdiff_t>(values.size() / 10);
  std::nth_element(values.begin(), values.begin() + tenth, values.end());
  const float min = values[static_cast<std::size_t>(tenth)];
  std::nth_element(values.begin(), values.end() - 1 - tenth, values.end());
  return {min, *(values.end() - 1 - tenth)};
}

/// What matches say about two views; keeps its memory from pair to pair.
class Geometry {
 public:
  explicit Geometry(InstructionSet instruction_set = active_instruction_set())
      : ransac_(instruction_set) {}

  /// `camera`: of both images; null = not known.
  void find_inliers(const Features& query, const Features& place, std::span<const Match> matches,
                    double max_error_px, const CameraModel* camera, std::vector<Match>& inliers) {
    inliers.clear();
    if (matches.size() < kMinMatchesForGeometry) return;
    pairs_.clear();
    for (const Match& match : matches) pairs_.push_back(pair_of(query, place, match));
    // A camera standing where it stood has a geometry, too, but one that no fundamental matrix is
    // determined by, so that RANSAC may find none.
    const auto is_unmoved = [&](const auto& pair) { return moved_px(pair) <= max_error_px; };
    const auto unmoved = std::count_if(pairs_.begin(), pairs_.end(), is_unmoved);
    const int found = has_rays(query, place, camera)
                          ? ransac_.find(rays_of(query, place, matches, *camera), max_error_px)
                          : ransac_.find(pairs_, max_error_px);
    const bool has_moved = found >= unmoved;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (has_moved ? ransac_.is_inlier()[i] != 0 : is_unmoved(pairs_[i])) {
        inliers.push_back(matches[i]);
      }
    }
  }

  int count_distinct(const Features& query, const Features& place, std::span<const Match> inliers,
                     double min_spacing_scales) {
    const auto repeats = [&](const Match& a, const Match& b) {
      return overlap(query.keypoint(a.query), query.keypoint(b.query), min_spacing_scales) ||
             overlap(place.keypoint(a.place), place.keypoint(b.place), min_spacing_scales);
    };
    distinct_.clear();
    for (const Match& match : inliers) {
      const bool is_new = std::none_of(distinct_.begin(), distinct_.end(),
                                       [&](const Match& other) { return repeats(match, other); });
      if (is_new) distinct_.push_back(match);
    }
    return static_cast<int>(distinct_.size());
  }

  double explained_share(const Features& query, std::span<const Match> inliers) {
    if (inliers.empty()) return 0;
    x_px_.clear();
    y_px_.clear();
    for (const Match& match : inliers) {
      x_px_.push_back(query.keypoint(match.query).x_px);
      y_px_.push_back(query.keypoint(match.query).y_px);
    }
    const Range x = middle(x_px_);
    const Range y = middle(y_px_);
    const auto is_amid = [&](const Keypoint& k) {
      return x.contains(k.x_px) && y.contains(k.y_px);
    };
    const auto features = std::count_if(query.keypoints.begin(), query.keypoints.end(), is_amid);
    const auto explained = std::count_if(inliers.begin(), inliers.end(), [&](const Match& match) {
      return is_amid(query.keypoint(match.query));
    });
    return features == 0 ? 0 : static_cast<double>(explained) / static_cast<double>(features);
  }

 private:
  std::span<const ViewRayPair> rays_of(const Features& query, const Features& place,
                                       std::span<const Match> matches,
                                       const CameraModel& calibrated) {
    const CameraModel camera = resized(calibrated, query.working_size_px);
    rays_.clear();
    for (const Match& match : matches) {
      rays_.push_back({ray_of(camera, query.keypoint(match.query)),
                       ray_of(camera, place.keypoint(match.place))});
    }
    return rays_;
  }

  EpipolarRansac ransac_;
  std::vector<EpipolarRansac::Pair> pairs_;
  std::vector<ViewRayPair> rays_;
  std::vector<Match> distinct_;
  std::vector<float> x_px_;
  std::vector<float> y_px_;
};

}  // namespace

class Verifier::Impl {
 public:
  Impl(const VerificationOptions& options, InstructionSet instruction_set)
      : options_(options), matcher_(instruction_set), geometry_(instruction_set) {
    validate(options, "verification");
  }

  void match_strongest(const Features& query, const Features& place, std::size_t strongest,
                       FirstLook& look) {
    matcher_.match_strongest(query, place, options_.max_ratio, strongest, look);
  }

  void match(const Features& query, const Features& place, const FirstLook& look,
             Verification& result) {
    matcher_.match(query, place, options_.max_ratio, look, result.matches);
    clear_geometry(result);
  }

  void match_some(const Features& query, std::span<const int> asked, const Features& place,
                  Verification& result) {
    matcher_.match_some(query, asked, place, options_.max_ratio, result.matches);
    clear_geometry(result);
  }

  void find_geometry(const Features& query, const Features& place, const CameraModel* camera,
                     Verification& result) {
    clear_geometry(result);
    if (result.matches.size() < static_cast<std::size_t>(options_.min_matches)) return;
    geometry_.find_inliers(query, place, result.matches, options_.max_epipolar_error_px, camera,
                           result.inliers);
    result.distinct_inliers =
        geometry_.count_distinct(query, place, result.inliers, options_.min_spacing_scales);
    result.explained_share = geometry_.explained_share(query, result.inliers);
  }

 private:
  static void clear_geometry(Verification& result) {
    result.inliers.clear();
    result.distinct_inliers = 0;
    result.explained_share = 0;
  }

  VerificationOptions options_;
  FeatureMatcher matcher_;
  Geometry geometry_;
};

Verifier::Verifier(const VerificationOptions& options, InstructionSet instruction_set)
    : impl_(std::make_unique<Impl>(options, instruction_set)) {}
Verifier::~Verifier() = default;
Verifier::Verifier(Verifier&&) noexcept = default;
Verifier& Verifier::operator=(Verifier&&) noexcept = default;

void Verifier::match(const Features& query, const Features& place, Verification& result) {
  impl_->match(query, place, FirstLook{}, result);
}

void Verifier::match_strongest(const Features& query, const Features& place, std::size_t strongest,
                               FirstLook& look) {
  impl_->match_strongest(query, place, strongest, look);
}

void Verifier::match(const Features& query, const Features& place, const FirstLook& look,
                     Verification& result) {
  impl_->match(query, place, look, result);
}

void Verifier::match_some(const Features& query, std::span<const int> asked, const Features& place,
                          Verification& result) {
  impl_->match_some(query, asked, place, result);
}

void Verifier::find_geometry(const Features& query, const Features& place, Verification& result,
                             const CameraModel* camera) {
  impl_->find_geometry(query, place, camera, result);
}

std::vector<Match> match_features(const Features& query, const Features& place, double max_ratio) {
  std::vector<Match> matches;
  FeatureMatcher(active_instruction_set()).match(query, place, max_ratio, FirstLook{}, matches);
  return matches;
}

std::vector<Match> epipolar_inliers(const Features& query, const Features& place,
                                    const std::vector<Match>& matches, double max_error_px,
                                    const CameraModel* camera) {
  std::vector<Match> inliers;
  Geometry().find_inliers(query, place, matches, max_error_px, camera, inliers);
  return inliers;
}

int chance_inliers(const Features& query, const Features& place, const CameraModel* camera) {
  return has_rays(query, place, camera) ? kChanceInliersOfRays : kChanceInliersOfPixels;
}

int distinct_inliers(const Features& query, const Features& place,
                     const std::vector<Match>& inliers, double min_spacing_scales) {
  return Geometry().count_distinct(query, place, inliers, min_spacing_scales);
}

double explained_share(const Features& query, const std::vector<Match>& inliers) {
  return Geometry().explained_share(query, inliers);
}

Verification verify(const Features& query, const Features& place,
                    const VerificationOptions& options, const CameraModel* camera) {
  Verifier verifier(options);
  Verification result;
  verifier.match(query, place, result);
  verifier.find_geometry(query, place, result, camera);
  return result;
}

}  // namespace loopbit
