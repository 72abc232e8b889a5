// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { kSteps, type RunModel, type Step } from "./run_model.ts";

/** Some frames, and the mean times of their steps. */
export interface TimeBin {
  from: number;
  to: number;
  frames: number[];
  mean_ms: Record<Step, number>;
  total_ms: number;
}

/** Limits the axis, so that the slowest frames do not squeeze the others; they are in the last bin. */
const kBeyond = 1.3;

function finished(model: RunModel, bin: { from: number; to: number; frames: number[] }): TimeBin {
  const mean_ms: Record<Step, number> = { content: 0, retrieval: 0, features: 0, verification: 0 };
  for (const step of kSteps) {
    const times = model.run.times_ms?.[step] ?? [];
    for (const frame of bin.frames) mean_ms[step] += times[frame] ?? 0;
    mean_ms[step] /= Math.max(1, bin.frames.length);
  }
  const total_ms = kSteps.reduce((sum, step) => sum + mean_ms[step], 0);
  return { ...bin, mean_ms, total_ms };
}

/** The frames by their total time: `from` and `to` in milliseconds. */
export function binsByTime(model: RunModel, count: number): TimeBin[] {
  const summary = model.totalTime();
  if (!summary || !model.totals_ms) return [];
  const { mean, p99, max } = summary;
  const end = Math.min(max, kBeyond * Math.max(p99, mean)) * 1.0001 || 1;
  const width = end / count;
  const bins = Array.from({ length: count }, (_, i) => ({
    from: i * width,
    to: (i + 1) * width,
    frames: [] as number[],
  }));
  model.totals_ms.forEach((total, frame) => {
    if (!model.isReadable(frame)) return;
    bins[Math.min(count - 1, Math.floor(total / width))]?.frames.push(frame);
  });
  return bins.map((bin) => finished(model, bin));
}

/** The frames in order, in at most `count` stretches: `from` and `to` in frames. */
export function binsByFrame(model: RunModel, count: number): TimeBin[] {
  const length = Math.max(1, Math.ceil(model.frames / count));
  const bins: TimeBin[] = [];
  for (let from = 0; from < model.frames; from += length) {
    const to = Math.min(model.frames, from + length);
    const frames: number[] = [];
    for (let frame = from; frame < to; ++frame) {
      if (model.isReadable(frame)) frames.push(frame);
    }
    bins.push(finished(model, { from, to, frames }));
  }
  return bins;
}
