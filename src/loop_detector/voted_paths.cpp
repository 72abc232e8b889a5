// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "voted_paths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <tuple>
#include <utility>

namespace loopbit {
namespace {

/// Of a feature nearest to each other on two levels of the pyramid, which are an octave apart.
constexpr float kMaxScaleRatio = 2.0F;
/// Displacements up to the whole image either way; a square of four bins is a tenth of its width.
constexpr int kBinsPerWidth = 20;
constexpr int kBins = 2 * kBinsPerWidth + 2;

/// A path of so many steps is straight, and outweighs chance.
constexpr std::ptrdiff_t kPathSteps = 10;
/// Speeds of a path as steps of the past for each step of the query, in tenths.
constexpr std::array kSpeedTenths{6, 7, 8, 9, 10, 11, 12, 13, 14};
/// Paths at most so many steps apart show the same place.
constexpr std::ptrdiff_t kApartSteps = 12;
/// A median and a deviation of fewer places tell little.
constexpr std::size_t kMinNull = 8;
/// One frame has no more to say than this, for or against: a few outstanding ones make no path.
constexpr double kMaxSigmas = 3;
/// The frame itself must speak for the end of its path; else the path may have left the past.
constexpr double kMinSigmasOfEnd = 1;
/// So many paths are followed, if their scores reach the deviation of a sum by chance.
constexpr std::size_t kFollowedPaths = 2;
constexpr double kMinFollowedSum = 3.1622776601683795;       // sqrt(kPathSteps)
constexpr double kDeviationOfDifference = 4.47213595499958;  // sqrt(2 kPathSteps)

/// The query's features whose nearest of the place has no nearer one in the query.
std::vector<Match> nearest_matches(const Features& query, const Features& place,
                                   const FirstLook& look) {
  std::vector<Match> best(place.keypoints.size(), Match{-1, -1});
  std::vector<std::int32_t> distances_sq(place.keypoints.size());
  const auto offer = [&](const FirstLook::Group& group, std::size_t first_query,
                         std::size_t first_place) {
    for (std::size_t i = 0; i < group.nearest.size(); ++i) {
      const FirstLook::Neighbours& found = group.nearest[i];
      const std::size_t at = first_place + static_cast<std::size_t>(found.index);
      if (best[at].query >= 0 && found.distance_sq >= distances_sq[at]) continue;
      best[at] = {static_cast<int>(first_query + i), static_cast<int>(at)};
      distances_sq[at] = found.distance_sq;
    }
  };
  if (look.dark.num_query > 0) offer(look.dark, 0, 0);
  if (look.bright.num_query > 0) offer(look.bright, query.num_dark, place.num_dark);
  std::vector<Match> by_query(query.keypoints.size(), Match{-1, -1});
  for (const Match& match : best) {
    if (match.query >= 0) by_query[static_cast<std::size_t>(match.query)] = match;
  }
  std::erase_if(by_query, [](const Match& match) { return match.query < 0; });
  return by_query;
}

struct Bin {
  int x = 0;
  int y = 0;
};

std::optional<Bin> bin_of(const Keypoint& a, const Keypoint& b, float bin_px) {
  if (a.scale > kMaxScaleRatio * b.scale || b.scale > kMaxScaleRatio * a.scale) return std::nullopt;
  const Bin bin{static_cast<int>(std::floor((a.x_px - b.x_px) / bin_px)) + kBins / 2,
                static_cast<int>(std::floor((a.y_px - b.y_px) / bin_px)) + kBins / 2};
  const auto is_in = [](int i) { return 0 <= i && i < kBins; };
  return is_in(bin.x) && is_in(bin.y) ? std::optional(bin) : std::nullopt;
}

/// How many displacements fall into each bin, row by row.
using Displacements = std::array<std::array<int, kBins>, kBins>;

/// The upper left bin of the square of four with most displacements.
Bin fullest_square(const Displacements& counts) {
  Bin best;
  int most = 0;
  for (std::size_t y = 0; y + 1 < kBins; ++y) {
    for (std::size_t x = 0; x + 1 < kBins; ++x) {
      const int count = counts[y][x] + counts[y][x + 1] + counts[y + 1][x] + counts[y + 1][x + 1];
      if (count > most) {
        most = count;
        best = {static_cast<int>(x), static_cast<int>(y)};
      }
    }
  }
  return best;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A count made alike at all sizes: its standard deviation by chance is 1/2 (Anscombe 1948).
double stabilized(int count) {
  constexpr double kShift = 3.0 / 8.0;
  return std::sqrt(count + kShift);
}
constexpr double kMinDeviation = 0.5;

double score_at(const VotedPaths::Scores& scores, std::ptrdiff_t step) {
  const auto found = std::ranges::lower_bound(scores, step, {}, &VotedPaths::Score::step);
  return found != scores.end() && found->step == step ? found->sigmas : 0.0;
}

}  // namespace

int displacement_votes(const Features& query, const Features& place, const FirstLook& look,
                       double min_spacing_scales) {
  const auto key = [](const Features& f, int i) -> const Keypoint& {
    return f.keypoints[static_cast<std::size_t>(i)];
  };
  const float bin_px = static_cast<float>(query.working_size_px.width) / kBinsPerWidth;
  const std::vector<Match> matches = nearest_matches(query, place, look);
  Displacements counts{};
  for (const Match& match : matches) {
    const auto bin = bin_of(key(query, match.query), key(place, match.place), bin_px);
    if (bin) ++counts[static_cast<std::size_t>(bin->y)][static_cast<std::size_t>(bin->x)];
  }
  const Bin square = fullest_square(counts);
  std::vector<Keypoint> counted;
  for (const Match& match : matches) {
    const Keypoint& here = key(query, match.query);
    const auto bin = bin_of(here, key(place, match.place), bin_px);
    const auto is_in = [](int i, int first) { return first <= i && i <= first + 1; };
    if (!bin || !is_in(bin->x, square.x) || !is_in(bin->y, square.y)) continue;
    const bool is_new = std::none_of(counted.begin(), counted.end(), [&](const Keypoint& other) {
      const auto spacing = min_spacing_scales * std::min(here.scale, other.scale);
      return std::hypot(here.x_px - other.x_px, here.y_px - other.y_px) < spacing;
    });
    if (is_new) counted.push_back(here);
  }
  return static_cast<int>(counted.size());
}

VotedPaths::Scores VotedPaths::scores(const std::vector<Votes>& votes, std::size_t num_similar) {
  Scores scores;
  if (num_similar < kMinNull) return scores;
  std::vector<double> null;
  for (const Votes& v : votes) {
    if (null.size() < num_similar) null.push_back(stabilized(v.votes));
  }
  const double middle = median(null);
  for (double& value : null) value = std::abs(value - middle);
  constexpr double kDeviationsPerMedian = 1.4826;  // of a normal distribution
  const double deviation = std::max(kMinDeviation, kDeviationsPerMedian * median(null));
  for (const Votes& v : votes) {
    const double sigmas = (stabilized(v.votes) - middle) / deviation;
    scores.push_back({v.place, v.step, std::clamp(sigmas, -kMaxSigmas, kMaxSigmas)});
  }
  // The best of each step comes first there.
  std::sort(scores.begin(), scores.end(), [](const Score& a, const Score& b) {
    return std::tuple(a.step, -a.sigmas, a.place) < std::tuple(b.step, -b.sigmas, b.place);
  });
  const auto is_same_step = [](const Score& a, const Score& b) { return a.step == b.step; };
  scores.erase(std::unique(scores.begin(), scores.end(), is_same_step), scores.end());
  return scores;
}

/// Of the steps before the next frame's.
double VotedPaths::sum_along(std::ptrdiff_t end, double steps_per_step, bool is_step) const {
  double sum = 0;
  // A frame that shows what the last step showed stands in its place.
  std::ptrdiff_t back = is_step ? 0 : -1;
  for (std::size_t i = steps_.size(); i-- > 0;) {
    if (++back == 0) continue;
    if (back == kPathSteps) break;
    sum += score_at(steps_[i], end - std::lround(steps_per_step * static_cast<double>(back)));
  }
  return sum;
}

VotedPaths::Path VotedPaths::best_path_to(const Score& end, bool is_step) const {
  constexpr double kTenths = 10;
  Path best{end, -std::numeric_limits<double>::infinity(), 0};
  for (const int tenths : kSpeedTenths) {
    for (const double speed : {tenths / kTenths, -tenths / kTenths}) {
      const double sum = end.sigmas + sum_along(end.step, speed, is_step);
      if (sum > best.sum) best = {end, sum, speed};
    }
  }
  return best;
}

std::vector<VotedPaths::Path> VotedPaths::paths(const Scores& latest, bool is_step) const {
  std::vector<Path> paths;
  paths.reserve(latest.size() + paths_.size());
  for (const Score& end : latest) paths.push_back(best_path_to(end, is_step));
  for (const Path& before : paths_) {
    const auto motion = is_step ? std::lround(before.steps_per_step) : 0;
    const Score end{before.end.place, before.end.step + motion, 0};
    const bool is_there =
        std::ranges::any_of(paths, [&](const Path& path) { return path.end.step == end.step; });
    if (is_there) continue;
    paths.push_back(best_path_to(end, is_step));
    if (paths.back().sum <= 0) paths.pop_back();
  }
  std::ranges::stable_sort(paths, std::ranges::greater{}, &Path::sum);
  return paths;
}

std::optional<VotedPaths::Best> VotedPaths::best(
    const std::vector<Path>& paths, const std::function<Spot(std::ptrdiff_t step)>& spot_of) {
  if (paths.empty() || paths.front().end.sigmas < kMinSigmasOfEnd) return std::nullopt;
  const Spot here = spot_of(paths.front().end.step);
  const auto rival = std::ranges::find_if(paths, [&](const Path& path) {
    const Spot there = spot_of(path.end.step);
    return std::abs(there.step - here.step) > kApartSteps &&
           std::abs(there.first_visit - here.first_visit) > kApartSteps;
  });
  const double elsewhere = rival == paths.end() ? 0.0 : std::max(0.0, rival->sum);
  return Best{paths.front(), (paths.front().sum - elsewhere) / kDeviationOfDifference};
}

void VotedPaths::remember(Scores latest, const std::vector<Path>& paths, bool is_step) {
  paths_ = paths;
  std::vector<std::ptrdiff_t> followed;
  expected_.clear();
  for (const Path& path : paths) {
    if (path.sum < kMinFollowedSum || followed.size() == kFollowedPaths) break;
    const bool is_followed = std::ranges::any_of(followed, [&](std::ptrdiff_t step) {
      return std::abs(step - path.end.step) <= kApartSteps;
    });
    if (is_followed) continue;
    followed.push_back(path.end.step);
    const auto next = path.end.place + static_cast<PlaceId>(std::lround(path.steps_per_step));
    for (const PlaceId place : {next - 1, next, next + 1}) expected_.push_back(place);
  }
  if (!is_step && !steps_.empty()) {
    steps_.back() = std::move(latest);
    return;
  }
  if (std::ssize(steps_) == kPathSteps) steps_.erase(steps_.begin());
  steps_.push_back(std::move(latest));
}

}  // namespace loopbit
