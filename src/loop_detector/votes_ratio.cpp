// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "votes_ratio.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "loopbit/median.hpp"

namespace loopbit {
namespace {

/// The square root of a count plus 3/8 has this deviation by chance (Anscombe 1948).
constexpr double kMinDeviation = 0.5;
constexpr double kDeviationsPerMedian = 1.4826;  // of a normal distribution
constexpr double kMinSigmas = -3;
constexpr double kMaxSigmas = 12;
/// Surroundings may be others within some four steps.
constexpr double kSameSurroundings = 0.75;
/// As if so many places just left had shown what similar ones do.
constexpr double kJustLeftPrior = 3;
/// A true place stands out by some three deviations on average, which is what a frame at night
/// shows; one by day shows more.
constexpr double kMeanSigmas = 3;
/// Degrees of freedom of the null, at most: what happens in one of many places cannot be learned
/// from thirty.
constexpr std::size_t kMaxDegrees = 20;

/// Density of a sum of an exponential variable of mean `mean` and a standard normal one.
double shifted_normal(double x, double mean) {
  const double tail = 0.5 * std::erfc((1 / mean - x) / std::numbers::sqrt2);
  return std::exp(-x / mean + 0.5 / (mean * mean)) * tail / mean;
}

/// std::lgamma() writes a global variable, and several threads may query.
double log_gamma(double x) {
  int sign = 0;
  return ::lgamma_r(x, &sign);
}

}  // namespace

double stabilized(int votes) { return std::sqrt(votes + 3.0 / 8.0); }

VotesNull VotesNull::by_medians(std::vector<double> votes) {
  const double middle = median(votes);
  for (double& value : votes) value = std::abs(value - middle);
  return {middle, kDeviationsPerMedian * median(votes)};
}

VotesNull VotesNull::by_means(double number, double sum, double sum_sq) {
  const double mean = sum / number;
  return {mean, std::sqrt(std::max(0.0, (sum_sq - sum * mean) / (number - 1)))};
}

VotesNull::VotesNull(double middle, double deviation)
    : middle_(middle), deviation_(std::max(kMinDeviation, deviation)) {}

double clamped_sigmas(double sigmas) { return std::clamp(sigmas, kMinSigmas, kMaxSigmas); }

JustLeft JustLeft::with(std::span<const double> sigmas) const {
  JustLeft next;
  next.count_ = kSameSurroundings * count_;
  next.sum_ = kSameSurroundings * sum_;
  next.sum_sq_ = kSameSurroundings * sum_sq_;
  for (const double of_place : sigmas) {
    next.count_ += 1;
    next.sum_ += of_place;
    next.sum_sq_ += of_place * of_place;
  }
  const double number = next.count_ + kJustLeftPrior;
  const double mean = next.sum_ / number;
  const double squares = next.sum_sq_ - 2 * mean * next.sum_ + next.count_ * mean * mean;
  next.mean_ = std::max(0.0, mean);
  next.deviation_ = std::max(1.0, std::sqrt((kJustLeftPrior + squares) / number));
  return next;
}

VotesRatio::VotesRatio(std::size_t num_null)
    : degrees_(static_cast<double>(std::min(kMaxDegrees, num_null - 1))),
      factor_(std::exp(log_gamma((degrees_ + 1) / 2) - log_gamma(degrees_ / 2)) /
              std::sqrt(degrees_ * std::numbers::pi)) {}

double VotesRatio::of(double sigmas) const {
  const double student_t = factor_ * std::pow(1 + sigmas * sigmas / degrees_, -(degrees_ + 1) / 2);
  return shifted_normal(sigmas, kMeanSigmas) / student_t;
}

}  // namespace loopbit
