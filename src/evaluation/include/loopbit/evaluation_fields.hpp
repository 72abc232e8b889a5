// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>

#include "loopbit/evaluation.hpp"

namespace loopbit {

/// The fields of an Evaluation below `place`, in order, without its lists. `io` is a JsonWriter or
/// a JsonReader. Not installed.
template <typename Io, typename Scored>
void transfer_evaluation(Io& io, const std::string& place, Scored& scored) {
  auto& decision = scored.decision;
  const Interval interval = decision.precision_interval();
  io.or_null(place + "/protocol", scored.options.protocol);
  io(place + "/tolerance_frames", scored.options.tolerance_frames);
  io(place + "/positives", decision.positives);
  io(place + "/right", decision.right);
  io(place + "/tolerated", decision.tolerated);
  io(place + "/wrong", decision.wrong);
  io(place + "/ignored", decision.ignored);
  io.derived(place + "/recall", decision.recall());
  io.derived(place + "/precision", decision.precision());
  io.derived(place + "/precision_interval", std::array{interval.low, interval.high});
  io(place + "/late/positives", scored.late.positives);
  io(place + "/late/right", scored.late.right);
  io(place + "/late/tolerated", scored.late.tolerated);
  io(place + "/late/wrong", scored.late.wrong);
  io.derived(place + "/late/recall", scored.late.recall());
  io.derived(place + "/late/precision", scored.late.precision());
  io(place + "/recall_at_full_precision", scored.recall_at_full_precision);
  io.or_null(place + "/score_at_full_precision", scored.score_at_full_precision);
  io(place + "/average_precision", scored.average_precision);
  io(place + "/pairs/positives", scored.pairs.positives);
  io(place + "/pairs/found", scored.pairs.found);
  io(place + "/pairs/right", scored.pairs.right);
  io(place + "/pairs/wrong", scored.pairs.wrong);
  io.derived(place + "/pairs/recall", scored.pairs.recall());
  io.derived(place + "/pairs/precision", scored.pairs.precision());
}

}  // namespace loopbit
