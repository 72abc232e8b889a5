// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session_odometry.hpp"

#include <algorithm>

#include "move_agreement.hpp"

namespace loopbit {

SessionOdometry::SessionOdometry(const LoopDetectorOptions& options, const Places& places)
    : places_(places),
      decision_(options.decision),
      correlated_m_(options.odometry.correlated_m),
      track_(options.odometry),
      paths_(track_, shortcuts_, Reach::views_sq(decision_)) {}

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

AgreementOfMove SessionOdometry::agreement(const std::optional<OdometryPose>& now) const {
  const auto latest_step = frame_of(places_.step_of(places_.size()));
  if (!now || !latest_step) return {};
  const auto latest = track_.to_next(*latest_step, track_.next(now));
  if (!latest) return {};
  return [this, agreement = MoveAgreement(track_, *latest)](
             std::ptrdiff_t from, std::ptrdiff_t to) -> std::optional<double> {
    const auto begin = frame_of(from);
    if (!begin) return std::nullopt;
    const auto end = frame_of(to);
    if (!end) return 1;  // the path ends before, where anything may follow
    return agreement.likelihood({frame_of(from - 1), *begin, frame_of(from + 1)}, *end);
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
  if (driven_m < correlated_m_) return std::nullopt;
  const bool agrees = undoubted(reach.chi2(*awaiting, *loop.match));
  return shortcuts_.prepare({loop.frame, *loop.match}, agrees);
}

}  // namespace loopbit
