// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "epipolar_ransac.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace loopbit {
namespace {

/// So many samples suffice for kConfidence where 55 % of the pairs are inliers.
constexpr int kMaxSamples = 500;
constexpr double kConfidence = 0.999;
constexpr int kRefits = 6;
/// They have an essential matrix always.
constexpr std::size_t kEssentialPairs = 5;

/// Different numbers from 0 to n - 1, the same for each run.
class Samples {
 public:
  explicit Samples(std::size_t n) : n_(n) {}

  std::array<std::size_t, kSamplePairs> next() {
    std::array<std::size_t, kSamplePairs> sample{};
    for (std::size_t i = 0; i < kSamplePairs; ++i) {
      do {
        sample[i] = draw();
      } while (std::find(sample.begin(), sample.begin() + i, sample[i]) != sample.begin() + i);
    }
    return sample;
  }

 private:
  std::size_t draw() {  // xorshift64* by Vigna
    state_ ^= state_ >> 12U;
    state_ ^= state_ << 25U;
    state_ ^= state_ >> 27U;
    return static_cast<std::size_t>(((state_ * 0x2545f4914f6cdd1dU) >> 32U) * n_ >> 32U);
  }

  std::size_t n_;
  std::uint64_t state_ = 2019;
};

/// The pairs of the next samples.
PairSamples gather(Samples& samples, const PointPairs& pairs) {
  PairSamples gathered;
  for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
    const auto sample = samples.next();
    for (std::size_t k = 0; k < kSamplePairs; ++k) {
      gathered.x0[k][lane] = pairs.x0[sample[k]];
      gathered.y0[k][lane] = pairs.y0[sample[k]];
      gathered.z0[k][lane] = pairs.z0[sample[k]];
      gathered.x1[k][lane] = pairs.x1[sample[k]];
      gathered.y1[k][lane] = pairs.y1[sample[k]];
      gathered.z1[k][lane] = pairs.z1[sample[k]];
    }
  }
  return gathered;
}

/// The real roots of a x^3 + b x^2 + c x + d; returns how many. None where a is 0: that is the
/// other matrix of the pencil alone, and a sample without noise.
int cubic_roots(double a, double b, double c, double d, std::array<double, 3>& roots) {
  if (a == 0) return 0;
  b /= a;
  c /= a;
  d /= a;
  const double q = (b * b - 3 * c) / 9;
  const double r = (2 * b * b * b - 9 * b * c + 27 * d) / 54;
  const double shift = b / 3;
  if (r * r < q * q * q) {
    const double angle = std::acos(r / std::sqrt(q * q * q));
    const double size = -2 * std::sqrt(q);
    for (int i = 0; i < 3; ++i) {
      roots[static_cast<std::size_t>(i)] =
          size * std::cos((angle + 2 * std::numbers::pi * i) / 3) - shift;
    }
    return 3;
  }
  const double s = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(r * r - q * q * q)), r);
  roots[0] = s + (s == 0 ? 0 : q / s) - shift;
  return 1;
}

/// The one to three fundamental matrices of one sample; returns how many.
int matrices_of(const EpipolarPencils& pencils, std::size_t lane,
                std::array<cv::Matx33d, 3>& models) {
  if (pencils.is_determined[lane] == 0) return 0;
  const auto& determinant = pencils.determinant;
  std::array<double, 3> roots{};
  const int count = cubic_roots(determinant[3][lane], determinant[2][lane], determinant[1][lane],
                                determinant[0][lane], roots);
  int finite = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    cv::Matx33d& model = models[static_cast<std::size_t>(finite)];
    for (std::size_t k = 0; k < 9; ++k) {
      model.val[k] = pencils.f[k][lane] + roots[i] * pencils.g[k][lane];
    }
    // Their size means nothing, so it is 1: no product of elements overflows then.
    const double size = cv::norm(model, cv::NORM_INF);
    if (size == 0 || !std::isfinite(size)) continue;
    model *= 1 / size;
    ++finite;
  }
  return finite;
}

/// The nearest matrix of rank two: without the part along the right singular vector of the smallest
/// singular value. The adjugate of f^T f has the same vectors and that one's value is by far its
/// largest, so powers of it lead there at once.
cv::Matx33d rank_two(const cv::Matx33d& f) {
  const cv::Matx33d squares = f.t() * f;
  const std::array<cv::Vec3d, 3> rows{cv::Vec3d(squares.val), cv::Vec3d(squares.val + 3),
                                      cv::Vec3d(squares.val + 6)};
  const std::array<cv::Vec3d, 3> adjugate{rows[1].cross(rows[2]), rows[2].cross(rows[0]),
                                          rows[0].cross(rows[1])};
  std::size_t start = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    const auto diagonal = [&](std::size_t k) { return adjugate[k][static_cast<int>(k)]; };
    if (diagonal(i) > diagonal(start)) start = i;
  }
  cv::Vec3d smallest = adjugate[start];
  constexpr int kIterations = 4;
  for (int i = 0; i < kIterations; ++i) {
    const double size = cv::norm(smallest);
    if (size == 0) return f;  // its rank is one already
    smallest *= 1 / size;
    smallest = {adjugate[0].dot(smallest), adjugate[1].dot(smallest), adjugate[2].dot(smallest)};
  }
  smallest = cv::normalize(smallest);
  const cv::Matx31d along(smallest.val);
  return f - f * along * along.t();
}

/// Samples that suffice to draw one of inliers only with the confidence.
int samples_needed(int inliers, std::size_t pairs) {
  const double share = static_cast<double>(inliers) / static_cast<double>(pairs);
  const double hit = std::pow(share, static_cast<double>(kSamplePairs));
  if (hit >= kConfidence) return 1;
  const double needed = std::log(1 - kConfidence) / std::log1p(-hit);
  return needed < kMaxSamples ? static_cast<int>(std::ceil(needed)) : kMaxSamples;
}

}  // namespace

/// Room for the coordinates of `count` pairs, all of them 0: x, y and z of both images, and
/// spreads.
std::array<float*, 8> EpipolarRansac::make_room(std::size_t count) {
  is_inlier_.assign((count / kPairBlock + 1) * kPairBlock, 0);
  std::array<float*, 8> arrays{};
  coordinates_.assign(arrays.size() * is_inlier_.size(), 0.0F);
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    arrays[i] = coordinates_.data() + i * is_inlier_.size();
  }
  const auto [x0, y0, z0, x1, y1, z1, spread_sq0, spread_sq1] = arrays;
  pairs_ = {x0, y0, z0, x1, y1, z1, count};
  spreads_ = {};
  return arrays;
}

void EpipolarRansac::normalize(std::span<const Pair> pairs, double max_error_px) {
  Pair mean;
  for (const Pair& p : pairs) {
    mean.x0 += p.x0;
    mean.y0 += p.y0;
    mean.x1 += p.x1;
    mean.y1 += p.y1;
  }
  const auto n = static_cast<float>(pairs.size());
  mean = {mean.x0 / n, mean.y0 / n, mean.x1 / n, mean.y1 / n};
  const auto [x0, y0, z0, x1, y1, z1, unused0, unused1] = make_room(pairs.size());
  float spread = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    x0[i] = pairs[i].x0 - mean.x0;
    y0[i] = pairs[i].y0 - mean.y0;
    x1[i] = pairs[i].x1 - mean.x1;
    y1[i] = pairs[i].y1 - mean.y1;
    spread += std::abs(x0[i]) + std::abs(y0[i]) + std::abs(x1[i]) + std::abs(y1[i]);
  }
  // One unit for both images, so that distances keep their proportion.
  const float unit = spread > 0 ? spread / (4 * n) : 1.0F;
  for (float& coordinate : coordinates_) coordinate /= unit;
  std::fill_n(z0, pairs.size(), 1.0F);
  std::fill_n(z1, pairs.size(), 1.0F);
  max_error_sq_ = static_cast<float>(max_error_px * max_error_px) / (unit * unit);
}

void EpipolarRansac::normalize(std::span<const ViewRayPair> pairs, double max_error_px) {
  const auto [x0, y0, z0, x1, y1, z1, spread_sq0, spread_sq1] = make_room(pairs.size());
  float spread = 0;
  for (const auto& [a, b] : pairs) {
    spread += std::abs(a.direction[0]) + std::abs(a.direction[1]);
    spread += std::abs(b.direction[0]) + std::abs(b.direction[1]);
  }
  const float unit = spread > 0 ? spread / (4 * static_cast<float>(pairs.size())) : 1.0F;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const cv::Vec3f& a = pairs[i].first.direction;
    const cv::Vec3f& b = pairs[i].second.direction;
    std::tie(x0[i], y0[i], z0[i]) = std::tuple(a[0] / unit, a[1] / unit, a[2]);
    std::tie(x1[i], y1[i], z1[i]) = std::tuple(b[0] / unit, b[1] / unit, b[2]);
    spread_sq0[i] = pairs[i].first.spread_sq;
    spread_sq1[i] = pairs[i].second.spread_sq;
  }
  spreads_ = {spread_sq0, spread_sq1, 1 / (unit * unit)};
  max_error_sq_ = static_cast<float>(max_error_px * max_error_px);
}

EpipolarScore EpipolarRansac::score(const cv::Matx33d& model) {
  std::array<float, 9> elements{};
  std::transform(std::begin(model.val), std::end(model.val), elements.begin(),
                 [](double element) { return static_cast<float>(element); });
  if (spreads_.sq0 == nullptr) {
    return kernels_.epipolar_score(elements.data(), pairs_, max_error_sq_, is_inlier_.data());
  }
  return kernels_.ray_score(elements.data(), pairs_, spreads_, max_error_sq_, is_inlier_.data());
}

/// What turns the algebraic error of a pair of rays into an angle, by the best model so far. The
/// spread of rays over a sphere is too uneven to do without; that of pixels is not.
double EpipolarRansac::fit_weight(std::size_t pair) const {
  if (spreads_.sq0 == nullptr) return 1;
  const cv::Vec3d first(pairs_.x0[pair], pairs_.y0[pair], pairs_.z0[pair]);
  const cv::Vec3d second(pairs_.x1[pair], pairs_.y1[pair], pairs_.z1[pair]);
  const auto size_sq = [&](const cv::Vec3d& gradient) {
    return spreads_.xy_scale_sq * (gradient[0] * gradient[0] + gradient[1] * gradient[1]) +
           gradient[2] * gradient[2];
  };
  return 1 / (spreads_.sq1[pair] * size_sq(best_ * first) +
              spreads_.sq0[pair] * size_sq(best_.t() * second));
}

/// The sum over the inliers of r r^T, where r = (x1, y1, z1) times (x0, y0, z0), each element with
/// each: its 81 elements are but 36 different sums.
cv::Matx<double, 9, 9> EpipolarRansac::sum_of_squares() const {
  constexpr std::size_t kProducts = 6;
  constexpr std::array<std::array<std::size_t, 3>, 3> kProduct{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};
  std::array<double, kProducts * kProducts> sums{};
  for (std::size_t k = 0; k < pairs_.count; ++k) {
    if (is_inlier_[k] == 0) continue;
    const double x0 = pairs_.x0[k];
    const double y0 = pairs_.y0[k];
    const double z0 = pairs_.z0[k];
    const double x1 = pairs_.x1[k];
    const double y1 = pairs_.y1[k];
    const double z1 = pairs_.z1[k];
    const double weight = fit_weight(k);
    const std::array<double, kProducts> of_first{x0 * x0, x0 * y0, x0 * z0,
                                                 y0 * y0, y0 * z0, z0 * z0};
    const std::array<double, kProducts> of_second{x1 * x1, x1 * y1, x1 * z1,
                                                  y1 * y1, y1 * z1, z1 * z1};
    for (std::size_t i = 0; i < kProducts; ++i) {
      const double weighted = weight * of_second[i];
      for (std::size_t j = 0; j < kProducts; ++j) sums[i * kProducts + j] += weighted * of_first[j];
    }
  }
  cv::Matx<double, 9, 9> squares;
  for (std::size_t row = 0; row < 9; ++row) {
    for (std::size_t column = 0; column < 9; ++column) {
      const std::size_t second = kProduct[row / 3][column / 3];
      const std::size_t first = kProduct[row % 3][column % 3];
      squares.val[row * 9 + column] = sums[second * kProducts + first];
    }
  }
  return squares;
}

/// The matrix that fits all inliers best, by the eight-point algorithm. What minimizes the sum of
/// squares is the eigenvector of the smallest eigenvalue; inverse iteration finds it from the best
/// model so far, without the other eight.
cv::Matx33d EpipolarRansac::fit() const {
  using Vector = cv::Matx<double, 9, 1>;
  cv::Matx<double, 9, 9> squares = sum_of_squares();
  // Where the inliers agree exactly there is no inverse without a little on the diagonal.
  constexpr double kRelativeShift = 1e-12;
  const double shift = kRelativeShift * cv::trace(squares);
  for (int i = 0; i < 9; ++i) squares(i, i) += shift;
  const cv::Matx<double, 9, 9> inverse = squares.inv(cv::DECOMP_CHOLESKY);
  constexpr int kIterations = 5;
  Vector f(best_.val);
  for (int i = 0; i < kIterations; ++i) {
    f = inverse * f;
    f *= 1 / cv::norm(f);
  }
  return rank_two(cv::Matx33d(f.val));
}

/// Expects is_inlier_ to be that of the best model.
void EpipolarRansac::refit() {
  for (int i = 0; i < kRefits && best_score_.inliers > static_cast<int>(kSamplePairs); ++i) {
    const cv::Matx33d model = fit();
    const EpipolarScore refitted = score(model);
    if (refitted.cost >= best_score_.cost) return;
    best_ = model;
    best_score_ = refitted;
  }
}

void EpipolarRansac::offer(const cv::Matx33d& model) {
  const EpipolarScore offered = score(model);
  if (offered.cost >= best_score_.cost) return;
  best_ = model;
  best_score_ = offered;
  refit();
}

int EpipolarRansac::find(std::span<const Pair> pairs, double max_error_px) {
  make_room(pairs.size());
  if (pairs.size() <= kSamplePairs) return 0;
  normalize(pairs, max_error_px);
  return search();
}

/// Of the best matrix, whose inliers are known. Sampling is for matrices with seven degrees of
/// freedom, which is much faster; those of a camera's motion have five.
void EpipolarRansac::make_essential(std::span<const ViewRayPair> pairs, double max_error_px) {
  const double unit = 1 / std::sqrt(static_cast<double>(spreads_.xy_scale_sq));
  const cv::Matx33d by_unit(unit, 0, 0, 0, unit, 0, 0, 0, 1);
  const cv::Matx33d by_inverse(1 / unit, 0, 0, 0, 1 / unit, 0, 0, 0, 1);
  const double huber_px = max_error_px / 2;
  best_score_ = {std::numeric_limits<float>::max(), 0};
  ViewMotion motion;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    ray_inliers_.clear();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (is_inlier_[i] != 0) ray_inliers_.push_back(pairs[i]);
    }
    if (ray_inliers_.size() < kEssentialPairs) return;
    if (round == 0) motion = find_motion(ray_inliers_, by_inverse * best_ * by_inverse, huber_px);
    refine_motion(ray_inliers_, huber_px, motion);
    const cv::Matx33d model = by_unit * motion.essential() * by_unit;
    const EpipolarScore refined = score(model);
    if (refined.cost >= best_score_.cost) return;
    best_ = model;
    best_score_ = refined;
  }
}

int EpipolarRansac::find(std::span<const ViewRayPair> pairs, double max_error_px) {
  make_room(pairs.size());
  if (pairs.size() <= kSamplePairs) return 0;
  normalize(pairs, max_error_px);
  if (search() == 0) return 0;
  make_essential(pairs, max_error_px);
  return score(best_).inliers;
}

int EpipolarRansac::search() {
  best_score_ = {max_error_sq_ * static_cast<float>(pairs_.count), 0};
  Samples samples(pairs_.count);
  EpipolarPencils pencils;
  std::array<cv::Matx33d, 3> models;
  int needed = samples_needed(static_cast<int>(kSamplePairs) + 1, pairs_.count);
  for (int i = 0; i < needed; ++i) {
    const std::size_t lane = static_cast<std::size_t>(i) % kSampleLanes;
    if (lane == 0) kernels_.solve_samples(gather(samples, pairs_), pencils);
    const int before = best_score_.inliers;
    const int count = matrices_of(pencils, lane, models);
    for (int k = 0; k < count; ++k) offer(models[static_cast<std::size_t>(k)]);
    if (best_score_.inliers > before) {
      needed = std::min(needed, samples_needed(best_score_.inliers, pairs_.count));
    }
  }
  return best_score_.inliers > 0 ? score(best_).inliers : 0;
}

}  // namespace loopbit
