// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "epipolar_ransac.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace loopbit {
namespace {

constexpr std::size_t kSample = 7;
constexpr int kMaxSamples = 500;
constexpr double kConfidence = 0.999;
constexpr int kRefits = 6;

using Row = std::array<double, 9>;
using Pair = EpipolarRansac::Pair;

/// One row of the epipolar constraint, for the elements of F row by row.
Row constraint(const Pair& p) {
  const double x0 = p.x0;
  const double y0 = p.y0;
  const double x1 = p.x1;
  const double y1 = p.y1;
  return {x1 * x0, x1 * y0, x1, y1 * x0, y1 * y0, y1, x0, y0, 1.0};
}

/// Different numbers from 0 to n - 1, the same for each run.
class Samples {
 public:
  explicit Samples(std::size_t n) : n_(n) {}

  std::array<std::size_t, kSample> next() {
    std::array<std::size_t, kSample> sample{};
    for (std::size_t i = 0; i < kSample; ++i) {
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

double determinant(const Row& f) {
  return f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) +
         f[2] * (f[3] * f[7] - f[4] * f[6]);
}

Row cofactors(const Row& f) {
  return {f[4] * f[8] - f[5] * f[7], f[5] * f[6] - f[3] * f[8], f[3] * f[7] - f[4] * f[6],
          f[2] * f[7] - f[1] * f[8], f[0] * f[8] - f[2] * f[6], f[1] * f[6] - f[0] * f[7],
          f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5], f[0] * f[4] - f[1] * f[3]};
}

double dot(const Row& a, const Row& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
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

/// Brings 7 rows to [identity, rest], columns in order; false where they do not determine it.
bool eliminate(std::array<Row, kSample>& rows) {
  constexpr double kMinPivot = 1e-9;
  for (std::size_t i = 0; i < kSample; ++i) {
    std::size_t pivot = i;
    for (std::size_t k = i + 1; k < kSample; ++k) {
      if (std::abs(rows[k][i]) > std::abs(rows[pivot][i])) pivot = k;
    }
    if (std::abs(rows[pivot][i]) < kMinPivot) return false;
    std::swap(rows[i], rows[pivot]);
    // The pivot's row is 0 before column i. Taking that in, too, makes loops of one length.
    const double factor = 1 / rows[i][i];
    for (double& element : rows[i]) element *= factor;
    const Row pivot_row = rows[i];
    for (std::size_t k = 0; k < kSample; ++k) {
      if (k == i) continue;
      const double part = rows[k][i];
      for (std::size_t j = 0; j < 9; ++j) rows[k][j] -= part * pivot_row[j];
    }
  }
  return true;
}

/// The one to three fundamental matrices of seven pairs; returns how many.
int seven_point(std::array<Row, kSample>& rows, std::array<cv::Matx33d, 3>& models) {
  if (!eliminate(rows)) return 0;
  Row f{};
  Row g{};
  for (std::size_t i = 0; i < kSample; ++i) {
    f[i] = -rows[i][7];
    g[i] = -rows[i][8];
  }
  f[7] = 1;
  g[8] = 1;
  // det(f + x g) = 0
  std::array<double, 3> roots{};
  const int count = cubic_roots(determinant(g), dot(cofactors(g), f), dot(cofactors(f), g),
                                determinant(f), roots);
  for (int i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 9; ++k) {
      models[static_cast<std::size_t>(i)].val[k] = f[k] + roots[static_cast<std::size_t>(i)] * g[k];
    }
  }
  return count;
}

/// The nearest matrix of rank two: without the part along the right singular vector of the smallest
/// singular value.
cv::Matx33d rank_two(const cv::Matx33d& f) {
  cv::Matx31d values;
  cv::Matx33d vectors;
  cv::eigen(f.t() * f, values, vectors);
  const cv::Matx31d smallest = vectors.row(2).t();
  return f - f * smallest * smallest.t();
}

/// Of the square of Sampson's distance: numerator and denominator.
struct Sampson {
  explicit Sampson(const cv::Matx33d& model) {
    for (int i = 0; i < 9; ++i) f[i] = static_cast<float>(model.val[i]);
  }

  [[nodiscard]] bool measure(const Pair& p, float max_error_sq, float& error_sq) const {
    const float ax = f[0] * p.x0 + f[1] * p.y0 + f[2];
    const float ay = f[3] * p.x0 + f[4] * p.y0 + f[5];
    const float az = f[6] * p.x0 + f[7] * p.y0 + f[8];
    const float bx = f[0] * p.x1 + f[3] * p.y1 + f[6];
    const float by = f[1] * p.x1 + f[4] * p.y1 + f[7];
    const float e = p.x1 * ax + p.y1 * ay + az;
    error_sq = e * e / (ax * ax + ay * ay + bx * bx + by * by);
    return error_sq <= max_error_sq;
  }

  float f[9];
};

/// Samples that suffice to draw one of inliers only with the confidence.
int samples_needed(int inliers, std::size_t pairs) {
  const double share = static_cast<double>(inliers) / static_cast<double>(pairs);
  const double hit = std::pow(share, static_cast<double>(kSample));
  if (hit >= kConfidence) return 1;
  const double needed = std::log(1 - kConfidence) / std::log1p(-hit);
  return needed < kMaxSamples ? static_cast<int>(std::ceil(needed)) : kMaxSamples;
}

}  // namespace

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
  float spread = 0;
  pairs_.clear();
  pairs_.reserve(pairs.size());
  for (const Pair& p : pairs) {
    pairs_.push_back({p.x0 - mean.x0, p.y0 - mean.y0, p.x1 - mean.x1, p.y1 - mean.y1});
    const Pair& q = pairs_.back();
    spread += std::abs(q.x0) + std::abs(q.y0) + std::abs(q.x1) + std::abs(q.y1);
  }
  // One unit for both images, so that distances keep their proportion.
  const float unit = spread > 0 ? spread / (4 * n) : 1.0F;
  for (Pair& p : pairs_) p = {p.x0 / unit, p.y0 / unit, p.x1 / unit, p.y1 / unit};
  max_error_sq_ = static_cast<float>(max_error_px * max_error_px) / (unit * unit);
}

EpipolarRansac::Score EpipolarRansac::score(const cv::Matx33d& model) const {
  const Sampson sampson(model);
  Score score;
  for (const Pair& p : pairs_) {
    float error_sq = 0;
    const bool inlier = sampson.measure(p, max_error_sq_, error_sq);
    score.inliers += inlier ? 1 : 0;
    score.cost += inlier ? error_sq : max_error_sq_;
  }
  return score;
}

void EpipolarRansac::mark(const cv::Matx33d& model) {
  const Sampson sampson(model);
  float error_sq = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    is_inlier_[i] = sampson.measure(pairs_[i], max_error_sq_, error_sq) ? 1 : 0;
  }
}

/// The matrix that fits all inliers best, by the eight-point algorithm. What minimizes the sum of
/// squares is the eigenvector of the smallest eigenvalue; inverse iteration finds it from the best
/// model so far, without the other eight.
cv::Matx33d EpipolarRansac::fit() const {
  using Vector = cv::Matx<double, 9, 1>;
  cv::Matx<double, 9, 9> squares = cv::Matx<double, 9, 9>::zeros();
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    if (is_inlier_[k] == 0) continue;
    const Vector row(constraint(pairs_[k]).data());
    squares += row * row.t();
  }
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

void EpipolarRansac::refit() {
  for (int i = 0; i < kRefits && best_score_.inliers > static_cast<int>(kSample); ++i) {
    mark(best_);
    const cv::Matx33d model = fit();
    const Score refitted = score(model);
    if (refitted.cost >= best_score_.cost) return;
    best_ = model;
    best_score_ = refitted;
  }
}

void EpipolarRansac::offer(const cv::Matx33d& model) {
  const Score offered = score(model);
  if (offered.cost >= best_score_.cost) return;
  best_ = model;
  best_score_ = offered;
  refit();
}

int EpipolarRansac::find(std::span<const Pair> pairs, double max_error_px) {
  is_inlier_.assign(pairs.size(), 0);
  if (pairs.size() <= kSample) return 0;
  normalize(pairs, max_error_px);
  best_score_ = {max_error_sq_ * static_cast<float>(pairs.size()), 0};
  Samples samples(pairs.size());
  std::array<Row, kSample> rows;
  std::array<cv::Matx33d, 3> models;
  int needed = samples_needed(static_cast<int>(kSample) + 1, pairs.size());
  for (int i = 0; i < needed; ++i) {
    const auto sample = samples.next();
    for (std::size_t k = 0; k < kSample; ++k) rows[k] = constraint(pairs_[sample[k]]);
    const int count = seven_point(rows, models);
    const int before = best_score_.inliers;
    for (int k = 0; k < count; ++k) offer(models[static_cast<std::size_t>(k)]);
    if (best_score_.inliers > before) {
      needed = std::min(needed, samples_needed(best_score_.inliers, pairs.size()));
    }
  }
  if (best_score_.inliers == 0) return 0;
  mark(best_);
  return best_score_.inliers;
}

}  // namespace loopbit
