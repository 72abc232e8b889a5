// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session_odometry.hpp"

#include <algorithm>

#include "move_agreement.hpp"

namespace loopbit {

SessionOdometry::SessionOdometry(const LoopDetectorOptions& options, const Places& places)
    : options_(options),
      places_(places),
      track_(options.odometry),
      paths_(track_, shortcuts_, Reach::views_sq(options.decision)) {}

std::optional<int> SessionOdometry::frame_of(std::ptrdiff_t step) const {
  const auto place = places_.place_of(step);
  if (!place || *place < places_.session_begin()) return std::nullopt;
  return *place - places_.session_begin();
}

double SessionOdometry::chi2(const Reach& reach, PlaceId place, PlaceId end) const {
  const PlaceId begin = places_.session_begin();
  const std::ptrdiff_t step = places_.step_of(place);
  double most = place < begin ? 0 : reach.chi2(place - begin);
  places_.known_loops().for_each_visit(step, places_.step_of(end), [&](std::ptrdiff_t at) {
    const auto frame = at == step ? std::nullopt : frame_of(at);
    if (frame) most = std::max(most, reach.chi2(*frame));
  });
  return most;
}

AgreementOfMoves SessionOdometry::agreement_of_moves(const std::optional<OdometryPose>& now) const {
  if (!now) return {};
  const auto latest_step = frame_of(places_.step_of(places_.size()));
  if (!latest_step) return {};
  const auto latest = track_.to_next(*latest_step, track_.next(now));
  if (!latest) return {};
  return [this, latest = *latest](std::ptrdiff_t step) -> std::optional<OfMoves> {
    const auto begin = frame_of(step);
    if (!begin) return std::nullopt;
    const MoveAgreement agreement(track_, latest, {frame_of(step - 1), *begin, frame_of(step + 1)});
    OfMoves of_moves;
    of_moves.fill(1);  // beyond the end of the path, where anything may follow
    for (std::ptrdiff_t move = -kMaxMove; move <= kMaxMove; ++move) {
      const auto end = frame_of(step + move);
      if (!end) continue;
      const auto likelihood = agreement.likelihood(*end);
      if (!likelihood) return std::nullopt;
      of_moves[static_cast<std::size_t>(kMaxMove + move)] = *likelihood;
    }
    return of_moves;
  };
}

std::optional<Shortcuts::Next> SessionOdometry::shortcuts_with(const Detection& loop,
                                                               const Reach& reach) const {
  const auto undoubted = [](double chi2) { return Reach::weight(chi2) == 1; };
  if (!loop.match || !track_.is_known(*loop.match)) return std::nullopt;
  if (!undoubted(reach.chi2(*loop.match))) return std::nullopt;
  const auto& awaiting = shortcuts_.awaiting();
  if (!awaiting) return shortcuts_.prepare({loop.frame, *loop.match}, false);
  const double driven_m = track_.next(loop.odometry).path_m - track_.path_m(awaiting->frame);
  if (driven_m < options_.odometry.correlated_m) return std::nullopt;
  const bool agrees = undoubted(reach.chi2(*awaiting, *loop.match));
  return shortcuts_.prepare({loop.frame, *loop.match}, agrees);
}

}  // namespace loopbit
