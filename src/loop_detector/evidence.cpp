// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace loopbit {
namespace {

/// The root of a count that chance makes spreads by a half, however large the count is.
constexpr double kRootSpread = 0.5;
/// Added to a count so that its root does so for small counts, too (Anscombe).
constexpr double kRootShift = 0.375;
/// Contents of different places differ by about so much in xi, before the map tells.
constexpr double kContentSpread = 0.1;
/// Inliers of random matches spread by two about chance_inliers(), before the map tells.
constexpr double kInlierSpread = 2.0;
/// What is expected before the map tells counts as much as so many places, or frames.
constexpr double kPriorWeight = 10.0;
/// Frames that the spread of a row is averaged over: the light and the street change.
constexpr double kRowMemory = 20.0;
/// Before a place stands out from its row, it is looked at by so many frames.
constexpr double kColumnPrior = 5.0;
/// A row tells its spread no better than this, and geometry worse: things that look alike have
/// heavy tails.
constexpr double kMostRowFreedom = 15.0;
constexpr double kGeometryFreedom = 6.0;
/// A place that was looked at tells of others no more than by so many spreads.
constexpr double kMostDeviation = 3.0;
constexpr double kMinLogTail = -1e-3;
constexpr double kMadToSpread = 1.4826;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

/// The middle of `values`, and the square of their spread about it, robustly.
struct Row {
  explicit Row(const std::vector<double>& values) : middle(median(values)) {
    std::vector<double> deviations;
    deviations.reserve(values.size());
    for (const double value : values) deviations.push_back(std::abs(value - middle));
    const double spread = kMadToSpread * median(std::move(deviations));
    spread_sq = spread * spread;
  }

  double middle;
  double spread_sq = 0;
};

/// Log of the chance that Student's t is at least `t` (Wallace 1959, right to a few percent).
double log_tail(double t, double freedom) {
  const double scale = (8 * freedom + 1) / (8 * freedom + 3);
  const double normal = scale * std::sqrt(freedom * std::log1p(t * t / freedom));
  const double tail = 0.5 * std::erfc(normal / std::numbers::sqrt2);
  return t < 0 ? std::log1p(-tail) : std::log(tail);
}

double log_ratio_of_tail(double log_tail) {
  if (log_tail > kMinLogTail) return -std::numbers::ln2;
  const double tail = std::exp(log_tail);
  return std::log(1 - tail + tail * log_tail) - log_tail - 2 * std::log(-log_tail);
}

}  // namespace

double log_likelihood_ratio(double value, const Null& null) {
  return log_ratio_of_tail(log_tail((value - null.middle) / null.spread, null.freedom));
}

double log_ratio_of_unseen() { return log_ratio_of_tail(-std::numbers::ln2); }

double chance_inliers(std::size_t matches) {
  constexpr double kAlwaysFit = 7;
  constexpr double kFitByChance = 1.0 / 12;
  return kAlwaysFit + kFitByChance * static_cast<double>(matches);
}

double LookedAt::excess() const {
  if (!verification || verification->inliers.empty()) return 0;
  return std::max(0.0, static_cast<double>(verification->inliers.size()) -
                           chance_inliers(verification->matches.size()));
}

NullModel::Lesson NullModel::weigh(std::vector<LookedAt>& places) const {
  std::vector<double> roots;
  std::vector<double> contents;
  const bool any_listed = std::any_of(places.begin(), places.end(),
                                      [](const LookedAt& place) { return place.is_listed; });
  for (LookedAt& place : places) {
    const Column& column = columns_[static_cast<std::size_t>(place.candidate.place)];
    place.root =
        std::sqrt(static_cast<double>(place.shared.size()) + kRootShift) -
        static_cast<double>(column.sum) / (static_cast<double>(column.count) + kColumnPrior);
    if (any_listed && !place.is_listed) continue;
    roots.push_back(place.root);
    contents.push_back(place.candidate.similarity);
  }
  const Row root(roots);
  const Row content(contents);
  const auto n = static_cast<double>(roots.size());
  const double kept = 1 - 1 / kRowMemory;
  const double weight = kept * row_weight_ + n + kPriorWeight;
  const auto pooled = [&](double before_sq, double now_sq, double prior) {
    return std::sqrt((kept * before_sq + n * now_sq + kPriorWeight * prior * prior) / weight);
  };
  const double freedom = std::min(kMostRowFreedom, n);
  const double of_few = std::sqrt(1 + 1 / n);  // the middle is uncertain, too
  const double root_spread = std::max(kRootSpread, pooled(root_sq_, root.spread_sq, kRootSpread));
  const Null root_null{root.middle, root_spread * of_few, freedom};
  const Null content_null{content.middle,
                          pooled(content_sq_, content.spread_sq, kContentSpread) * of_few, freedom};
  for (LookedAt& place : places) {
    place.matching_log_ratio = log_likelihood_ratio(place.root, root_null);
    place.content_log_ratio = log_likelihood_ratio(place.candidate.similarity, content_null);
  }
  return {root.middle, root.spread_sq, content.spread_sq, n, root_spread};
}

void NullModel::weigh_geometry(LookedAt& place) const {
  if (!place.verification || place.verification->inliers.empty()) return;
  const double beyond = static_cast<double>(place.verification->inliers.size()) -
                        chance_inliers(place.verification->matches.size());
  Null null{0, kInlierSpread, kGeometryFreedom};
  if (beyond > 0) {
    null.spread = std::sqrt((kPriorWeight * kInlierSpread * kInlierSpread + excess_sq_) /
                            (kPriorWeight + excess_frames_));
  }
  place.geometry_log_ratio = log_likelihood_ratio(beyond, null);
}

void NullModel::reserve_next(std::size_t places) {
  if (places + 1 > columns_.capacity()) columns_.reserve(2 * places + 1);
}

void NullModel::learn_rows(const Lesson& lesson) {
  const double kept = 1 - 1 / kRowMemory;
  root_sq_ = kept * root_sq_ + lesson.places * lesson.root_spread_sq;
  content_sq_ = kept * content_sq_ + lesson.places * lesson.content_spread_sq;
  row_weight_ = kept * row_weight_ + lesson.places;
}

void NullModel::learn_column(const Lesson& lesson, const LookedAt& place, double weight) {
  const auto number = static_cast<std::size_t>(place.candidate.place);
  if (number >= columns_.size()) return;
  const double most = kMostDeviation * lesson.root_spread;
  const double above =
      std::sqrt(static_cast<double>(place.shared.size()) + kRootShift) - lesson.root_middle;
  columns_[number].sum += static_cast<float>(weight * std::clamp(above, -most, most));
  columns_[number].count += static_cast<float>(weight);
}

}  // namespace loopbit
