// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Revisit, Run, TimeSummary, Verdict } from "./report_data.ts";
import type { Against } from "./store.ts";
import { isMarked, type Marked } from "./verdicts.ts";

export const kFilters = [
  "all",
  "loops",
  "right",
  "wrong",
  "missed",
  "tolerated",
  "elsewhere",
] as const;
export type Filter = (typeof kFilters)[number];
/** In which order the arrow keys visit frames; the weakest have the lowest scores. */
export type Order = "frame" | "weakest";

export type Step = "content" | "retrieval" | "features" | "verification";
export const kSteps: readonly Step[] = ["content", "retrieval", "features", "verification"];

/** The detector's default, for runs without a record. */
const kDefaultShiftTolerance = 4;

/** Fewer loops than that are drawn one by one. */
const kLongRevisit = 3;
/** How far a loop of a revisit may lie from its ends, in frames; see revisits.hpp. */
const kReach = 20;

/** What a later frame changed of a frame's decision. */
export interface Change {
  /** As loops.csv writes it. */
  matchName: string;
  /** Null if the match is in an earlier session of the map. */
  match: number | null;
  score: number;
  isWithdrawn: boolean;
  /** The later frame. */
  by: number;
}

type Span = readonly [first: number, last: number];

/** A frame of an earlier session of the map. */
export interface EarlierFrame {
  session: number;
  frame: number;
}

/** A run, and values derived from its columns. */
export class RunModel {
  /** Total milliseconds per frame; null if the detector does not report them. */
  totals_ms: readonly number[] | null;
  /** The revisits that are drawn as one: those of several loops. */
  readonly longRevisits: readonly Revisit[];
  private readonly truth = new Map<number, Span[]>();
  private readonly members = new Map<Filter, readonly number[]>();
  private readonly marked = new Map<Marked, readonly number[]>();
  private changed: ReadonlyMap<number, readonly Change[]>;

  private size: number;

  /** `isLive`: frames are still being added. */
  constructor(
    readonly run: Run,
    readonly isLive = false,
  ) {
    this.totals_ms = totals(run);
    this.changed = changesOf(run);
    this.size = run.frames;
    this.longRevisits = run.revisits.filter(({ loops }) => loops >= kLongRevisit);
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

  /** Whether frames were added since the last grow(). */
  hasGrown(): boolean {
    return this.run.frames !== this.size;
  }

  /** Takes in the frames that were added to the run. */
  grow(): void {
    this.size = this.run.frames;
    this.totals_ms = totals(this.run);
    this.changed = changesOf(this.run);
    this.members.clear();
    this.marked.clear();
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

  /** Whether it is a loop with a frame of this run, which can be drawn. */
  isLoopHere(frame: number): boolean {
    return this.isLoop(frame) && this.match(frame) !== null;
  }

  isReadable(frame: number): boolean {
    return this.status(frame) !== "unreadable";
  }

  /** Null if the detector reports nothing for the frame. */
  score(frame: number): number | null {
    return this.run.score[frame] ?? null;
  }

  /** The name of its image, unless that is only its number. */
  name(frame: number): string | null {
    const name = this.run.names?.[frame] ?? "";
    return name === "" || name === String(frame) ? null : name;
  }

  /**
   * The frame that a text means: a number; a name or a part of one, the next from `frame` on; or
   * seconds since the first frame, as "12.5 s". Null if there is none.
   */
  find(text: string, frame: number): number | null {
    const number = Number(text);
    if (String(number) === text && Number.isInteger(number))
      return Math.min(number, this.frames - 1);
    const named = this.run.names?.indexOf(text) ?? -1;
    if (named >= 0) return named;
    const seconds = text.match(/^(\d+(?:\.\d*)?) ?s$/);
    if (seconds) return this.frameAt(Number(seconds[1]));
    const names = this.run.names ?? [];
    const isHit = (name: string) => name.includes(text);
    const next = names.findIndex((name, i) => i > frame && isHit(name));
    const any = next < 0 ? names.findIndex(isHit) : next;
    return any < 0 ? null : any;
  }

  /** The frame whose time is nearest, in seconds since the first; null without times. */
  private frameAt(time_s: number): number | null {
    const apart = (frame: number) =>
      Math.abs((this.run.timestamp_s?.[frame] ?? Number.NaN) - this.firstTime() - time_s);
    const timed = this.where((frame) => !Number.isNaN(apart(frame)));
    return timed.reduce<number | null>(
      (best, frame) => (best === null || apart(frame) < apart(best) ? frame : best),
      null,
    );
  }

  /** Whether the detector reports unreadable frames. */
  tellsUnreadable(): boolean {
    return this.run.status_names.includes("unreadable");
  }

  unreadable(): number {
    return this.where((frame) => !this.isReadable(frame)).length;
  }

  framesWithCandidate(): number {
    return this.where((frame) => this.score(frame) !== null).length;
  }

  /** The best candidate, accepted or not, if it is a frame of this run. */
  match(frame: number): number | null {
    const match = this.run.match[frame] ?? -1;
    return match < 0 ? null : match;
  }

  /** The best candidate, if it is a frame of an earlier session of the map. */
  earlierMatch(frame: number): EarlierFrame | null {
    const match = this.run.earlier_match?.[frame];
    return match ? { session: match[0], frame: match[1] } : null;
  }

  /** The best candidate as loops.csv writes it: "17", or "1:17" for frame 17 of session 1. */
  matchName(frame: number): string | null {
    const earlier = this.earlierMatch(frame);
    if (earlier) return `${earlier.session}:${earlier.frame}`;
    const match = this.match(frame);
    return match === null ? null : String(match);
  }

  /** What later frames changed of a frame's decision, in order. */
  changes(frame: number): readonly Change[] {
    return this.changed.get(frame) ?? [];
  }

  /** The late loops with a frame of this run that were not withdrawn, as pairs. */
  lateLoops(): [frame: number, match: number][] {
    return [...this.changed].flatMap(([frame, changes]): [number, number][] => {
      const last = changes.at(-1);
      return last && !last.isWithdrawn && last.match !== null ? [[frame, last.match]] : [];
    });
  }

  /** Whether the pose graph rejected a loop. */
  isRejected(query: number, match: number | null): boolean {
    const loops = this.run.correction?.loops ?? [];
    return loops.some(
      (frame, i) => i % 3 === 0 && frame === query && loops[i + 1] === match && loops[i + 2] === 0,
    );
  }

  /** How many loops were found late, or withdrawn. */
  countChanges(isWithdrawn: boolean): number {
    const all = [...this.changed.values()].flat();
    return all.filter((change) => change.isWithdrawn === isWithdrawn).length;
  }

  trueSpans(frame: number): readonly Span[] {
    return this.truth.get(frame) ?? [];
  }

  /** The true place that represents all of a frame's: the middle of its first span. */
  truePlace(frame: number): number | null {
    const span = this.trueSpans(frame)[0];
    return span ? span[0] + Math.floor((span[1] - span[0]) / 2) : null;
  }

  /** The frame of this run that is shown beside the selected one. */
  partner({ frame, against }: { frame: number; against: Against }): number | null {
    if (against === "match") return this.match(frame);
    return against === "truth" ? this.truePlace(frame) : against;
  }

  /** Whether the frame beside the selected one is its best candidate, or would be. */
  isWithCandidate(selection: { frame: number; against: Against }): boolean {
    const { frame, against } = selection;
    if (against === "match") return true;
    const match = this.match(frame);
    return match !== null && match === this.partner(selection);
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

  /**
   * Those of them that are loops with a frame of this run: a missed frame may be one, too, but not
   * with a true place.
   */
  loopsMarked(verdict: Marked): readonly number[] {
    return this.framesMarked(verdict).filter((frame) => this.isLoopHere(frame));
  }

  /** The frames that pass a filter, in order. */
  framesIn(filter: Filter): readonly number[] {
    let frames = this.members.get(filter);
    if (!frames) {
      if (filter === "all") frames = this.where(() => true);
      else if (filter === "loops") frames = this.where((frame) => this.isLoop(frame));
      else if (filter === "missed") frames = this.where((frame) => this.isMissed(frame));
      else frames = this.framesMarked(filter);
      this.members.set(filter, frames);
    }
    return frames;
  }

  /** The frames that pass a filter, as the arrow keys visit them. */
  walk(filter: Filter, order: Order): readonly number[] {
    const frames = this.framesIn(filter);
    if (order === "frame") return frames;
    const score = (frame: number) => this.score(frame) ?? Number.POSITIVE_INFINITY;
    return [...frames].sort((a, b) => score(a) - score(b) || a - b);
  }

  /** Whether a loop is one of a long revisit's. */
  isInLongRevisit(frame: number): boolean {
    const match = this.match(frame) ?? -1;
    return this.longRevisits.some(({ query, match: [a, b] }) => {
      const isAmong = frame >= query[0] && frame <= query[1];
      return isAmong && match >= Math.min(a, b) - kReach && match <= Math.max(a, b) + kReach;
    });
  }

  /** The loops with a frame of another session. */
  loopsElsewhere(): readonly number[] {
    return this.framesIn("loops").filter((frame) => !this.isLoopHere(frame));
  }

  /** Time of the first frame that has one, in seconds. */
  firstTime(): number {
    return this.run.timestamp_s?.find((time) => time !== null) ?? 0;
  }

  get shiftTolerance(): number {
    const columns = this.run.record?.options["retrieval"]?.["shift_tolerance_columns"];
    return typeof columns === "number" ? columns : kDefaultShiftTolerance;
  }

  /** As in run.json, otherwise from the columns; null if there are none. */
  totalTime(): TimeSummary | null {
    return this.run.record?.times_ms?.total ?? (this.totals_ms && this.summary(this.totals_ms));
  }

  stepTime(step: Step): TimeSummary | null {
    const times = this.run.times_ms?.[step];
    return this.run.record?.times_ms?.[step] ?? (times ? this.summary(times) : null);
  }

  /** The mark of a frame. An ignored frame has one only if it is a loop. */
  mark(frame: number): Marked | null {
    const verdict = this.verdict(frame);
    return isMarked(verdict) && (verdict !== "ignored" || this.isLoop(frame)) ? verdict : null;
  }

  /** A revisit without a right loop. One with a wrong loop is marked as wrong. */
  private isMissed(frame: number): boolean {
    const mark = this.mark(frame);
    return mark === "missed" || (mark === "wrong" && this.truePlace(frame) !== null);
  }

  private where(passes: (frame: number) => boolean): number[] {
    const frames: number[] = [];
    for (let frame = 0; frame < this.frames; ++frame) {
      if (passes(frame)) frames.push(frame);
    }
    return frames;
  }

  /** Over the readable frames, by the rule of run.json: quantiles are nearest ranks. */
  private summary(times: readonly number[]): TimeSummary {
    const sorted = times.filter((_, frame) => this.isReadable(frame)).sort((a, b) => a - b);
    const quantile = (q: number) => sorted[Math.ceil(q * sorted.length) - 1] ?? 0;
    const mean = sorted.reduce((sum, time) => sum + time, 0) / Math.max(1, sorted.length);
    return { mean, p50: quantile(0.5), p99: quantile(0.99), max: quantile(1) };
  }
}

function changesOf({ late_loops }: Run): Map<number, Change[]> {
  const changes = new Map<number, Change[]>();
  for (const [by, loops] of (late_loops ?? []).entries()) {
    for (const [frame, to, score, isWithdrawn] of loops ?? []) {
      const match = typeof to === "number" ? to : null;
      const matchName = typeof to === "number" ? String(to) : to.join(":");
      const change = { match, matchName, score, isWithdrawn, by };
      changes.set(frame, [...(changes.get(frame) ?? []), change]);
    }
  }
  return changes;
}

function totals(run: Run): number[] | null {
  const times = run.times_ms;
  if (!times) return null;
  return times.content.map((_, frame) =>
    kSteps.reduce((sum, step) => sum + (times[step][frame] ?? 0), 0),
  );
}
