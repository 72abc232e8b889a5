// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

/** What the page shows: the JSON that src/report/report.cpp puts into the page. */
export interface ReportData {
  /** Version of loopbit that wrote the report. */
  loopbit: string;
  /** One run, or several on the same input. */
  runs: Run[];
  /** All settings as they are if none is given: `loopbit options --json`. */
  default_options?: RunRecord["options"];
}

/** How truth judges a frame. `found`, `missed`: revisits; the rest of the frames have no true earlier place. */
export type Verdict =
  | "none" // no loop, and none was to be found (or no truth)
  | "right" // a loop, and true
  | "tolerated" // a loop that is neither right nor wrong
  | "wrong" // a loop, and false
  | "missed" // a revisit without a right loop: status tells why
  | "loop" // a loop, and no truth to judge it by
  | "elsewhere" // a loop into an earlier session of the map, which truth does not speak of
  | "ignored"; // left out of the score

/** Columns have one entry a frame. */
export interface Run {
  name: string;
  /** run.json as it stands in the folder; null for another detector's matches. */
  record: RunRecord | null;
  /** The score from which the detector accepts (decision.min_score). */
  threshold: number | null;
  frames: number;
  /** Else there are at least so many: a detector lists no frames that it has nothing to say of. */
  frames_known: boolean;
  timestamp_s: (number | null)[] | null;
  /** Names of statuses ("loop", "no_earlier_place", ...), and an index into them for each frame. */
  status_names: string[];
  status: number[];
  /** The best candidate, accepted or not; -1 without one, or if it is in `earlier_match`. */
  match: number[];
  /** The best candidates that are frames of earlier sessions of the map; null if none is. */
  earlier_match: ([session: number, frame: number] | null)[] | null;
  /** Null where the detector says nothing of a frame. */
  score: (number | null)[];
  /** These are null where the detector does not report them. */
  similarity: number[] | null;
  matches: number[] | null;
  inliers: number[] | null;
  times_ms: StepTimes | null;
  verdict: Verdict[];
  /** Flat triples query, first, last; and where that is from, in words, if it is known. */
  truth: { same_place: number[]; near_place: number[]; source: string | null } | null;
  evaluation: Evaluation | null;
  /** Camera centres in the plane of the world in which they reach furthest, m; null where not known. */
  positions: {
    x_m: (number | null)[];
    y_m: (number | null)[];
    axes: [x: string, y: string];
  } | null;
  similarity_matrix: SimilarityMatrix | null;
  /** By frame number. Not every frame has one: the report has a size budget. */
  pictures: Record<string, Picture>;
}

export interface StepTimes {
  content: number[];
  retrieval: number[];
  features: number[];
  verification: number[];
}

export interface TimeSummary {
  mean: number;
  p50: number;
  p99: number;
  max: number;
}

/** See docs/run_folder.md. A run that did not end has no results. */
export interface RunRecord {
  loopbit: string;
  /** What followed the name of the command; none if a library made the run. */
  arguments?: string[];
  input: { path: string; description: string; every: number; limit: number };
  /** Where what was seen is kept, and which of its sessions this run is. */
  map?: { path: string; session: number };
  stopped_by: string;
  options: Record<string, Record<string, number | boolean>>;
  machine: { processor: string; cores: number; kernel: string; system: string };
  threads: number;
  counts?: { frames: number; by_status: Record<string, number> };
  times_ms?: Record<keyof StepTimes, TimeSummary> & { total?: TimeSummary };
  wall_s?: number;
  frames_per_s?: number;
  peak_memory_mib?: number;
}

/** A point of the precision-recall curve: all queries with at least this score. */
export interface CurvePoint {
  score: number;
  right: number;
  wrong: number;
  precision: number;
  recall: number;
}

/** See docs/evaluation.md. */
export interface Evaluation {
  protocol: string | null;
  positives: number;
  right: number;
  tolerated: number;
  wrong: number;
  ignored: number;
  recall: number;
  precision: number;
  /** 95 %, Wilson. */
  precision_interval: [number, number];
  recall_at_full_precision: number;
  /** The lowest score without a wrong loop at or above it; null if even the best is wrong. */
  score_at_full_precision: number | null;
  average_precision: number;
  pairs: { positives: number; right: number; recall: number };
  curve: CurvePoint[];
}

/** xi of two frames each, at most `side` cells a side: the largest of those compared in a cell. */
export interface SimilarityMatrix {
  side: number;
  frames_per_cell: number;
  /** Every so-many-th frame was compared with every so-many-th, and each frame with its match. */
  compared_every: number;
  /** base64 PNG, 8-bit grey, side x side, row = later frame, column = earlier; 255 = xi of 1. */
  png: string;
}

/** Strings are base64. */
export interface Picture {
  /** JPEG, small. */
  jpeg: string;
  /** PNG, 64 x 64, 8-bit grey, scaled so that 255 is the map's largest value. */
  saliency: string | null;
  /** 512 bytes: 64 rows of 8 bytes, little-endian; bit 0 of a row is its left edge. */
  content: string | null;
  /** Little-endian float32 quadruples: x, y in this frame and x, y in its match (`match` column),
   * each from 0 to 1 of width or height. */
  inliers: string | null;
}
