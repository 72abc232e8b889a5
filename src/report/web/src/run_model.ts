// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Run, TimeSummary, Verdict } from "./report_data.ts";
import type { Against } from "./store.ts";
import { isMarked, type Marked } from "./verdicts.ts";

export const kFilters = ["all", "loops", "right", "wrong", "missed", "tolerated"] as const;
export type Filter = (typeof kFilters)[number];

export type Step = "content" | "retrieval" | "features" | "verification";
export const kSteps: readonly Step[] = ["content", "retrieval", "features", "verification"];

/** The detector's default, for runs that left no record of theirs. */
const kDefaultShiftTolerance = 4;

type Span = readonly [first: number, last: number];

/** A run, and what follows from its columns. */
export class RunModel {
  /** Milliseconds of all steps, one a frame; null where the detector does not report them. */
  readonly totals_ms: readonly number[] | null;
  private readonly truth = new Map<number, Span[]>();
  private readonly members = new Map<Filter, readonly number[]>();
  private readonly marked = new Map<Marked, readonly number[]>();

  constructor(readonly run: Run) {
    this.totals_ms = totals(run);
    const triples = run.truth?.same_place ?? [];
    for (let i = 0; i + 2 < triples.length; i += 3) {
      const [query, first, last] = triples.slice(i, i + 3) as [number, number, number];
      const spans = this.truth.get(query);
      if (spans) spans.push([first, last]);
      else this.truth.set(query, [[first, last]]);
    }
  }

  get frames(): number {
    return this.run.frames;
  }

  verdict(frame: number): Verdict {
    return this.run.verdict[frame] ?? "none";
  }

  status(frame: number): string {
    return this.run.status_names[this.run.status[frame] ?? -1] ?? "";
  }

  isLoop(frame: number): boolean {
    return this.status(frame) === "loop";
  }

  isReadable(frame: number): boolean {
    return this.status(frame) !== "unreadable";
  }

  score(frame: number): number {
    return this.run.score[frame] ?? 0;
  }

  /** The best candidate, accepted or not. */
  match(frame: number): number | null {
    const match = this.run.match[frame] ?? -1;
    return match < 0 ? null : match;
  }

  trueSpans(frame: number): readonly Span[] {
    return this.truth.get(frame) ?? [];
  }

  /** The true place that stands for all of a frame's: the middle of its first span. */
  truePlace(frame: number): number | null {
    const span = this.trueSpans(frame)[0];
    return span ? span[0] + Math.floor((span[1] - span[0]) / 2) : null;
  }

  /** The frame that is shown beside the selected one. */
  partner({ frame, against }: { frame: number; against: Against }): number | null {
    if (against === "match") return this.match(frame);
    return against === "truth" ? this.truePlace(frame) : against;
  }

  /** The frames that have this mark, in order. */
  framesMarked(verdict: Marked): readonly number[] {
    let frames = this.marked.get(verdict);
    if (!frames) {
      frames = this.where((frame) => this.mark(frame) === verdict);
      this.marked.set(verdict, frames);
    }
    return frames;
  }

  /** Those of them that are loops: a missed frame may be one, too, but not with a true place. */
  loopsMarked(verdict: Marked): readonly number[] {
    return this.framesMarked(verdict).filter((frame) => this.isLoop(frame));
  }

  /** The frames that pass a filter, in order. */
  framesIn(filter: Filter): readonly number[] {
    let frames = this.members.get(filter);
    if (!frames) {
      if (filter === "all") frames = this.where(() => true);
      else if (filter === "loops") frames = this.where((frame) => this.isLoop(frame));
      else frames = this.framesMarked(filter);
      this.members.set(filter, frames);
    }
    return frames;
  }

  get shiftTolerance(): number {
    const columns = this.run.record?.options["retrieval"]?.["shift_tolerance_columns"];
    return typeof columns === "number" ? columns : kDefaultShiftTolerance;
  }

  /** As run.json has it, else from the columns; null where there are none. */
  totalTime(): TimeSummary | null {
    return this.run.record?.times_ms.total ?? (this.totals_ms && this.summary(this.totals_ms));
  }

  stepTime(step: Step): TimeSummary | null {
    if (this.run.record) return this.run.record.times_ms[step];
    return this.run.times_ms && this.summary(this.run.times_ms[step]);
  }

  /** The frame to begin with: what went wrong, else the clearest loop. */
  firstFrame(): number {
    const wrong = this.framesIn("wrong")[0];
    if (wrong !== undefined) return wrong;
    let best = -1;
    for (const frame of this.framesIn("loops")) {
      if (best < 0 || this.score(frame) > this.score(best)) best = frame;
    }
    return best >= 0 ? best : (this.framesIn("missed")[0] ?? 0);
  }

  /** What the frame is marked as; an ignored frame only if it is a loop. */
  mark(frame: number): Marked | null {
    const verdict = this.verdict(frame);
    return isMarked(verdict) && (verdict !== "ignored" || this.isLoop(frame)) ? verdict : null;
  }

  private where(passes: (frame: number) => boolean): number[] {
    const frames: number[] = [];
    for (let frame = 0; frame < this.frames; ++frame) {
      if (passes(frame)) frames.push(frame);
    }
    return frames;
  }

  /** Over the readable frames, by the rule of run.json. */
  private summary(times: readonly number[]): TimeSummary {
    const sorted = times.filter((_, frame) => this.isReadable(frame)).sort((a, b) => a - b);
    const quantile = (q: number) => sorted[Math.floor(q * (sorted.length - 1))] ?? 0;
    const mean = sorted.reduce((sum, time) => sum + time, 0) / Math.max(1, sorted.length);
    return { mean, p50: quantile(0.5), p99: quantile(0.99), max: quantile(1) };
  }
}

function totals(run: Run): number[] | null {
  const times = run.times_ms;
  if (!times) return null;
  return times.content.map((_, frame) =>
    kSteps.reduce((sum, step) => sum + (times[step][frame] ?? 0), 0),
  );
}
