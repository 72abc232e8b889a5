// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <utility>

#include "votes_ratio.hpp"

namespace loopbit {
namespace {

/// Steps at most so far apart show the same place.
constexpr std::ptrdiff_t kOnePathSteps = 12;
/// Laps known to be one place share a fifth of their probability with each step.
constexpr double kShareOfLaps = 0.2;
/// Hypotheses below this are dropped: some twenty frames of evidence could not bring them back.
constexpr double kMinProbability = 1e-6;

/// As likely as not, the displacement of the right place is steady.
constexpr double kSteady = 0.5;
/// A camera that is level displaces sideways, by ten squares either way: to know which one is worth
/// no more.
constexpr double kMostSteady = 10;
/// One frame changes what is known of a place by no more.
constexpr double kMaxLearned = 3;
/// A place's own mean counts once it was seen by some frames.
constexpr double kShownPrior = 5;

/// A true place has some ten inliers beyond chance where geometry sees any, which is every second
/// frame.
constexpr double kGeometryDensity = 0.5 / 10;
/// Inliers of a wrong place persist half as long along a path as its votes.
constexpr double kGeometryIndependence = 2;
/// How rare a thing is can be known no better than by one in so many steps: inliers count fully
/// once the map has so many, and before at most in proportion to the logarithm.
constexpr double kFullSteps = 200;
/// Just beyond chance, wrong places are as frequent as just below: the rate of wrong places counts
/// fully from so many inliers beyond.
constexpr double kFullExcess = 4;
/// No frame can say more.
constexpr double kMaxLogRatio = 30;

template <typename Pairs>
auto find_step(Pairs& pairs, std::ptrdiff_t step) {
  const auto found =
      std::ranges::lower_bound(pairs, step, {}, [](const auto& p) { return p.first; });
  return found != pairs.end() && found->first == step ? found : pairs.end();
}

/// Laps through one place are one place: what is known of one is known of the other.
void share_among_laps(const KnownLoops& loops, std::vector<Hypothesis>& places) {
  std::vector<std::ptrdiff_t> steps;
  steps.reserve(places.size());
  for (const auto& at : places) steps.push_back(at.step);
  for (const std::ptrdiff_t step : steps) {
    const auto first = loops.first_visit_of(step);
    if (!first) continue;
    hypothesis_at(places, *first);  // so that the next two are there already
    Hypothesis& here = hypothesis_at(places, step);
    Hypothesis& there = hypothesis_at(places, *first);
    for (std::size_t m = 0; m < kNumMotions; ++m) {
      const double shared = kShareOfLaps * (there.by_motion[m] - here.by_motion[m]);
      here.by_motion[m] += shared;
      there.by_motion[m] -= shared;
    }
  }
}

/// The largest value of each step, in their order.
template <typename Value>
ByStep largest_of_steps(const std::vector<PlaceFilter::Observed>& observed, const Value& value) {
  ByStep largest;
  for (const PlaceFilter::Observed& o : observed) largest.emplace_back(o.step, value(o));
  std::ranges::sort(largest, std::greater{});
  const auto repeats = [](const auto& a, const auto& b) { return a.first == b.first; };
  largest.erase(std::unique(largest.begin(), largest.end(), repeats), largest.end());
  std::ranges::reverse(largest);
  return largest;
}

ByStep log_ratios(const std::vector<PlaceFilter::Observed>& observed) {
  return largest_of_steps(observed, [](const auto& o) { return o.log_likelihood_ratio(); });
}

/// Bayes' rule: makes a prior the posterior, given the log likelihood ratio of each step that was
/// looked at against "somewhere new". Returns the probability of the latter, even where it is very
/// small.
double weigh(const ByStep& ratios, Belief& belief) {
  double elsewhere = belief.elsewhere();
  double sum = elsewhere;
  for (Hypothesis& h : belief.places) {
    const auto found = find_step(ratios, h.step);
    const double ratio = found == ratios.end() ? 1.0 : std::exp(found->second);
    h.multiply(ratio);
    sum += h.probability();
  }
  for (Hypothesis& h : belief.places) h.multiply(1 / sum);
  elsewhere /= sum;
  std::erase_if(belief.places, [&](const Hypothesis& h) {
    const bool is_dropped = h.probability() < kMinProbability;
    if (is_dropped) elsewhere += h.probability();
    return is_dropped;
  });
  return elsewhere;
}

/// Of the candidates that may match and for which `is_eligible(o)`, the one with the largest
/// `value(o)`.
template <typename Eligible, typename Value>
std::optional<std::size_t> best_of(const std::vector<PlaceFilter::Observed>& observed,
                                   const Eligible& is_eligible, const Value& value) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (!observed[i].may_match || !is_eligible(observed[i])) continue;
    if (!best || value(observed[i]) > value(observed[*best])) best = i;
  }
  return best;
}

/// What the filter knows of where the robot is after a frame.
struct Posterior {
  const std::vector<Hypothesis>& places;
  double elsewhere = 0;  ///< the rest of the probability, even where it is very small
};

/// Log odds of one that becomes `exp(log_ratio)` times as probable, for log_ratio <= 0.
double less_probable(double log_odds, double log_ratio) {
  return log_odds + log_ratio - std::log1p(-std::expm1(log_ratio) * std::exp(log_odds));
}

/// The terms of a match, of which all but the path are known, so that they add up to `log_odds`.
ScoreTerms with_path(ScoreTerms terms, double log_odds) {
  terms.path = 0;
  terms.path = log_odds - terms.sum();
  for (double* term : {&terms.votes, &terms.geometry, &terms.path, &terms.rivals, &terms.prior}) {
    *term = PlaceFilter::rounded(*term);
  }
  return terms;
}

/// Of a match near the likeliest step: all hypotheses around it and on laps through the same place
/// count for it.
double log_odds_near(std::ptrdiff_t middle, const Posterior& posterior, const KnownLoops& loops,
                     ScoreTerms& terms) {
  double here = 0;
  double others = posterior.elsewhere;
  for (const Hypothesis& h : posterior.places) {
    (PlaceFilter::is_near(h.step, middle, loops) ? here : others) += h.probability();
  }
  terms.rivals = std::log(posterior.elsewhere / others);
  return std::log(here / others);
}

/// Of a match for which no path speaks: it is as probable as after a return from somewhere new.
double log_odds_from_anywhere(const Posterior& posterior, const ScoreTerms& terms) {
  double revisit = 0;
  for (const Hypothesis& h : posterior.places) revisit += h.probability();
  const double log_odds = terms.sum();
  return revisit > 0 ? std::min(log_odds, std::log(revisit / posterior.elsewhere)) : log_odds;
}

/// Which candidate is the match. `middle`: the likeliest step, if there is one.
std::optional<std::size_t> choose_match(std::optional<std::ptrdiff_t> middle,
                                        const KnownLoops& loops,
                                        const PlaceFilter::Update& update) {
  using Observed = PlaceFilter::Observed;
  const auto any = [](const Observed& /*o*/) { return true; };
  const auto ratio = [](const Observed& o) { return o.log_likelihood_ratio(); };
  if (!middle) return best_of(update.observed, any, ratio);
  // A place elsewhere that shows so much by itself that it needs no path shares the view, from
  // closer.
  const auto best = best_of(update.observed, any, [&](const Observed& o) {
    return ratio(o) +
           std::log(std::max(update.prior.at(o.step), probability_at(update.returns, o.step)));
  });
  if (!best || !PlaceFilter::is_near(update.observed[*best].step, *middle, loops)) return best;
  return PlaceFilter::match_near(*middle, update.observed, update.belief, loops);
}

/// Why the match is as probable as it is.
ScoreTerms explain(std::optional<std::ptrdiff_t> middle, const Posterior& posterior,
                   const Returns& returns, const KnownLoops& loops,
                   const PlaceFilter::Observed& match) {
  const double ratio = match.log_likelihood_ratio();
  ScoreTerms terms{.votes = match.votes,
                   .geometry = ratio - match.votes,
                   .prior = std::log(2 * probability_at(returns, match.step))};
  double log_odds = middle && PlaceFilter::is_near(match.step, *middle, loops)
                        ? log_odds_near(*middle, posterior, loops, terms)
                        : log_odds_from_anywhere(posterior, terms);
  // A path may end at any frame: one that speaks against its match is no loop.
  if (ratio < 0) log_odds = less_probable(log_odds, ratio);
  return with_path(terms, log_odds);
}

}  // namespace

double PlaceFilter::Observed::log_likelihood_ratio() const {
  return rounded(std::min(kMaxLogRatio, votes + geometry));
}

bool PlaceFilter::is_near(std::ptrdiff_t a, std::ptrdiff_t b, const KnownLoops& loops) {
  return std::abs(a - b) <= kOnePathSteps || is_same_place(spot_of(a, loops), spot_of(b, loops));
}

double PlaceFilter::rounded(double value) {
  constexpr double kScale = 1 << 30;
  return std::round(value * kScale) / kScale;
}

std::optional<std::size_t> PlaceFilter::match_near(std::ptrdiff_t middle,
                                                   const std::vector<Observed>& observed,
                                                   const Belief& belief, const KnownLoops& loops) {
  const auto is_here = [&](const Observed& o) { return is_near(o.step, middle, loops); };
  const auto shared = [&](const Observed& o) {
    // One step may be more probable than the next by chance.
    const double probability =
        belief.at(o.step) + (belief.at(o.step - 1) + belief.at(o.step + 1)) / 2;
    return std::pair(probability * o.num_votes, o.log_likelihood_ratio());
  };
  const auto match = best_of(observed, is_here, shared);
  // A step may be probable by its path alone. Another view of the place is the match if both votes
  // and inliers say so; among its steps, which look much alike, the path decides again.
  const auto view = best_of(
      observed,
      [&](const Observed& o) {
        return is_here(o) && o.geometry > 0 && o.num_votes >= observed[*match].num_votes;
      },
      [](const Observed& o) { return rounded(o.geometry); });
  if (!view) return match;
  return best_of(
      observed,
      [&](const Observed& o) {
        return is_here(o) && std::abs(o.step - observed[*view].step) <= kUsualMove;
      },
      shared);
}

Belief PlaceFilter::predict(bool is_step, const AgreementOfMoves& agreement) const {
  if (!is_step) return before_;
  return one_step_later(belief_, leave_probability(votes_.independence(), followed_), agreement);
}

std::vector<std::ptrdiff_t> PlaceFilter::likeliest(const Belief& belief, double min_probability,
                                                   std::size_t most) {
  std::vector<Hypothesis> places = belief.places;
  std::ranges::stable_sort(places, std::greater{}, &Hypothesis::probability);
  std::vector<std::ptrdiff_t> steps;
  for (const Hypothesis& h : places) {
    if (steps.size() == most || h.probability() < min_probability) break;
    const bool is_apart = std::ranges::all_of(
        steps, [&](std::ptrdiff_t s) { return std::abs(s - h.step) > kOnePathSteps / 2; });
    if (is_apart) steps.push_back(h.step);
  }
  return steps;
}

/// Votes in standard deviations from what similar places and those just left have, less what this
/// place shows other frames. If there is a null, sets `just_left` to what is known of the latter
/// after this frame.
std::vector<double> PlaceFilter::deviations(const std::vector<VerifiedCandidate>& verified,
                                            std::size_t num_similar,
                                            const std::vector<int>& votes_just_left,
                                            JustLeft& just_left) const {
  std::vector<double> sigmas(verified.size(), 0.0);
  if (num_similar < kMinNull) return sigmas;
  std::vector<double> null;
  null.reserve(num_similar);
  for (std::size_t i = 0; i < num_similar; ++i) {
    null.push_back(stabilized(verified[i].votes.count));
  }
  const auto votes_null = VotesNull::by_medians(std::move(null));
  std::vector<double> left;
  left.reserve(votes_just_left.size());
  for (const int votes : votes_just_left) left.push_back(clamped_sigmas(votes_null.sigmas(votes)));
  just_left = just_left_.with(left);
  for (std::size_t i = 0; i < verified.size(); ++i) {
    const double z = just_left.beyond(votes_null.sigmas(verified[i].votes.count));
    sigmas[i] = clamped_sigmas(z - mean_shown(verified[i].step));
  }
  return sigmas;
}

/// The more alike a wrong place looks from one step to the next, the less the inliers of each
/// count.
double PlaceFilter::geometry_independence() const {
  const double correlation =
      std::clamp(same_path_products_.value() / same_path_squares_.value(), 0.0, 0.95);
  return std::min(1.0, kGeometryIndependence * (1 - correlation) / (1 + correlation));
}

/// Where the displacement is steady, votes say more; how much more is measured on its own.
double PlaceFilter::votes_log_ratio(double sigmas, std::size_t num_null,
                                    const std::optional<SteadyDisplacements::Seen>& steady) const {
  const double ratio = VotesRatio(num_null).of(sigmas);
  const double known = votes_.independence() * std::log(ratio);
  if (!steady) return known;
  return known + std::min(votes_.independence(), steady_.independence()) *
                     std::log(1 - kSteady + kSteady * std::min(kMostSteady, steady->ratio / ratio));
}

/// The tail of wrong places is a Lomax distribution: an exponential one whose mean is only as well
/// known as the map is large. Geometry chose the candidate among all steps, which is why their
/// number counts.
double PlaceFilter::geometry_log_ratio(const CandidateGeometry& geometry,
                                       std::ptrdiff_t num_steps) const {
  const auto steps = static_cast<double>(std::max<std::ptrdiff_t>(1, num_steps));
  const double known = std::min(1.0, std::log1p(steps) / std::log1p(kFullSteps));
  const double excess = geometry.excess(known);
  if (excess <= 0) return 0;
  const double rate = tail_.seen / (tail_.seen + tail_.unseen);
  const double at_beginning =
      std::log(steps * kGeometryDensity * tail_.excess / (rate * tail_.count));
  const double growth = (tail_.count + 1) * std::log1p(excess / tail_.excess);
  return geometry_independence() *
         std::max(0.0, growth + std::min(1.0, excess / kFullExcess) * at_beginning);
}

double PlaceFilter::probability_alone(const CandidateGeometry& geometry,
                                      std::ptrdiff_t num_steps) const {
  const double ratio = std::min(kMaxLogRatio, geometry_log_ratio(geometry, num_steps));
  return 1 / (1 + std::exp(-ratio) / from_anywhere(num_steps));
}

void PlaceFilter::observe(const std::vector<VerifiedCandidate>& verified, std::size_t num_similar,
                          const Steps& known, const KnownLoops& loops, Update& update) const {
  update.just_left = just_left_;
  const std::vector<double> sigmas =
      deviations(verified, num_similar, known.votes_just_left, update.just_left);
  const auto steady =
      steady_.look(verified, num_similar, known.is_step,
                   [&](std::ptrdiff_t a, std::ptrdiff_t b) { return is_near(a, b, loops); });
  update.observed.reserve(verified.size());
  for (std::size_t i = 0; i < verified.size(); ++i) {
    Observed o{.candidate = verified[i].candidate,
               .step = verified[i].step,
               .may_match = verified[i].may_match,
               .num_votes = verified[i].votes.count,
               .sigmas = sigmas[i],
               .square = verified[i].votes.square};
    if (steady[i]) o.steady_sigmas = steady[i]->sigmas;
    if (num_similar >= kMinNull) o.votes = votes_log_ratio(sigmas[i], num_similar, steady[i]);
    if (verified[i].geometry) {
      o.excess = verified[i].geometry->excess();
      o.geometry = geometry_log_ratio(*verified[i].geometry, known.number);
    }
    update.observed.push_back(o);
  }
}

PlaceFilter::Update PlaceFilter::update(Belief prior,
                                        const std::vector<VerifiedCandidate>& verified,
                                        std::size_t num_similar, const Steps& known,
                                        const KnownLoops& loops) const {
  Update update;
  observe(verified, num_similar, known, loops, update);
  update.has_null = num_similar >= kMinNull;
  std::erase_if(prior.places, [&](const Hypothesis& h) { return !known.may_be_at(h.step); });
  std::vector<std::ptrdiff_t> steps;
  steps.reserve(update.observed.size());
  for (const Observed& o : update.observed) {
    if (o.may_match) steps.push_back(o.step);
  }
  update.returns = returns_to(std::move(steps), known.number, known.return_weight);
  add_returns(update.returns, prior);
  share_among_laps(loops, prior.places);

  update.belief.places = prior.places;
  const double elsewhere = weigh(log_ratios(update.observed), update.belief);
  update.prior = std::move(prior);
  const auto middle = update.belief.peak();
  update.match = choose_match(middle, loops, update);
  if (update.match) {
    update.terms = explain(middle, {update.belief.places, elsewhere}, update.returns, loops,
                           update.observed[*update.match]);
    update.probability = rounded(1 / (1 + std::exp(-update.terms.sum())));
  }
  update.revisit = rounded(1 - update.belief.elsewhere());
  return update;
}

PlaceFilter::Next PlaceFilter::prepare(Update update, bool is_step, const KnownLoops& loops) {
  Next next{.tail = tail_, .is_step = is_step};
  if (is_step) {
    learn(update, loops, next);
    next.just_left = update.just_left;
    for (const auto& [step, sigmas] : next.sigmas) shown_.try_emplace(step);
    next.before = std::move(update.prior);
    next.followed = followed_until(update.belief);
  }
  next.belief = std::move(update.belief);
  return next;
}

/// Where the likeliest step is at another place than before, another path begins.
Followed PlaceFilter::followed_until(const Belief& belief) const {
  const auto before = belief_.peak();
  const auto now = belief.peak();
  const bool goes_on = before && now && std::abs(*now - *before) <= kOnePathSteps;
  if (!goes_on || belief.elsewhere() > 0.5) return {};
  return {followed_.steps + 1, followed_.independent + votes_.independence()};
}

/// What is not near the likeliest place was wrong, as far as the robot is somewhere new.
void PlaceFilter::learn(const Update& update, const KnownLoops& loops, Next& next) const {
  const auto middle = update.belief.peak();
  std::vector<Observed> wrong = update.observed;
  if (middle && update.probability > 0.5) {
    std::erase_if(wrong, [&](const Observed& o) { return is_near(o.step, *middle, loops); });
  }
  double excess = 0;
  for (const Observed& o : wrong) excess = std::max(excess, o.excess);
  const double weight = 1 - update.revisit;
  if (excess > 0) {
    next.tail.seen += weight;
    next.tail.count += weight;
    next.tail.excess += weight * excess;
  } else {
    next.tail.unseen += weight;
  }
  learn_steady(update, wrong, next);
  next.has_null = update.has_null;
  if (!update.has_null) return;
  const auto deviation = [](const Observed& o) { return o.sigmas; };
  next.sigmas = largest_of_steps(wrong, deviation);
  for (const auto& [step, sigmas] : next.sigmas) {
    next.shown.push_back(std::clamp(sigmas + mean_shown(step), -kMaxLearned, kMaxLearned));
  }
  // Another storey, which cannot match, looks like this one all along a path.
  std::erase_if(wrong, [](const Observed& o) { return !o.may_match; });
  const ByStep on_paths = largest_of_steps(wrong, deviation);
  next.votes = votes_.prepare(on_paths);
  for (const auto& [step, sigmas] : on_paths) {
    const auto before = find_step(latest_sigmas_, step - 1);
    if (before == latest_sigmas_.end()) continue;
    next.products += sigmas * before->second;
    next.squares += (sigmas * sigmas + before->second * before->second) / 2;
  }
}

void PlaceFilter::learn_steady(const Update& update, std::vector<Observed> wrong,
                               Next& next) const {
  SteadyDisplacements::Squares fullest;
  fullest.reserve(update.observed.size());
  for (const Observed& o : update.observed) fullest.emplace_back(o.step, o.square);
  std::erase_if(wrong, [](const Observed& o) { return !o.may_match || !o.steady_sigmas; });
  const auto sigmas = [](const Observed& o) { return o.steady_sigmas.value_or(0); };
  next.steady = steady_.prepare(std::move(fullest), largest_of_steps(wrong, sigmas));
}

void PlaceFilter::commit(Next next) noexcept {
  belief_ = std::move(next.belief);
  if (!next.is_step) return;
  followed_ = next.followed;
  before_ = std::move(next.before);
  tail_ = next.tail;
  just_left_ = next.just_left;
  steady_.commit(std::move(next.steady));
  if (!next.has_null) return;
  for (std::size_t i = 0; i < next.sigmas.size(); ++i) {
    Shown& shown = shown_.find(next.sigmas[i].first)->second;
    shown.sum += next.shown[i];
    ++shown.count;
  }
  latest_sigmas_ = std::move(next.sigmas);
  votes_.commit(std::move(next.votes));
  same_path_products_.add(next.products);
  same_path_squares_.add(next.squares);
}

/// Of the frames of other places that were compared with the step, drawn towards 0 while they are
/// few.
double PlaceFilter::mean_shown(std::ptrdiff_t step) const {
  const auto found = shown_.find(step);
  return found == shown_.end() ? 0.0 : found->second.sum / (found->second.count + kShownPrior);
}

void PlaceFilter::withdraw(std::ptrdiff_t step, const KnownLoops& loops) {
  for (Belief* belief : {&before_, &belief_}) {
    std::erase_if(belief->places,
                  [&](const Hypothesis& h) { return is_near(h.step, step, loops); });
  }
}

}  // namespace loopbit
