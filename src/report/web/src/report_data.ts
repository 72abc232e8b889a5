// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

/** The data of the page: the JSON that src/report/report.cpp writes into it. */
export interface ReportData {
  /** Version of loopbit that wrote the report. */
  loopbit: string;
  /** One run, or several on the same input. */
  runs: Run[];
  /** The default settings, as in `loopbit options --json`. */
  default_options?: RunRecord["options"];
  /** Of a run that goes on: its ID, by which the server knows it. See live.ts. */
  live?: string;
}

/** The verdict on a frame. Only revisits can be `missed`. */
export type Verdict =
  | "none" // no loop, and no revisit (or no truth)
  | "right" // a right loop
  | "tolerated" // a loop that is neither right nor wrong
  | "wrong" // a wrong loop
  | "missed" // a revisit without a right loop; the status says why
  | "loop" // a loop without truth
  | "elsewhere" // a loop into an earlier session of the map, which truth does not cover
  | "ignored"; // not scored

/** Loops in a row: the camera passes places in the order of an earlier pass, or in reverse. */
export interface Revisit {
  /** First and last frame. */
  query: [number, number];
  /** Their matches. */
  match: [number, number];
  loops: number;
}

/** Columns have one entry per frame. */
export interface Run {
  name: string;
  /** run.json as it stands in the folder; null for another detector's matches. */
  record: RunRecord | null;
  /** The score from which the detector accepts (decision.min_score). */
  threshold: number | null;
  frames: number;
  /** False if `frames` is a lower bound: other detectors may list only frames with a match. */
  frames_known: boolean;
  /** Names of the images; null if unknown. */
  names: string[] | null;
  timestamp_s: (number | null)[] | null;
  /** Names of statuses ("loop", "no_earlier_place", ...), and an index into them for each frame. */
  status_names: string[];
  status: number[];
  /** The best candidate, accepted or not; -1 without one, or if it is in `earlier_match`. */
  match: number[];
  /** The best candidates that are frames of earlier sessions of the map; null if none is. */
  earlier_match: ([session: number, frame: number] | null)[] | null;
  /** Null if the detector reports nothing for a frame. */
  score: (number | null)[];
  /** What a frame changed of earlier ones; null for frames that changed nothing. */
  late_loops: (LateLoop[] | null)[] | null;
  /** Of the log odds of the score; null if the detector does not report them. */
  terms: ScoreTerms | null;
  /** Null if the detector does not report them. */
  similarity: number[] | null;
  matches: number[] | null;
  inliers: number[] | null;
  times_ms: StepTimes | null;
  verdict: Verdict[];
  /** The frame that the page opens on. */
  first_frame: number;
  /** The accepted matches, grouped, in the order of their first queries. */
  revisits: Revisit[];
  /** Flat triples query, first, last; and a description of the source, if known. */
  truth: { same_place: number[]; near_place: number[]; source: string | null } | null;
  evaluation: Evaluation | null;
  /** Camera centres in the plane of their largest extent, m; null if unknown. */
  positions: Positions | null;
  /** Null if the trajectory was not corrected. */
  correction: TrajectoryCorrection | null;
  similarity_matrix: SimilarityMatrix | null;
  /** Relative poses of loops by query; null if none were measured. */
  poses: Record<string, LoopPose> | null;
  /** By frame number. Not every frame has one: the report has a size budget, which the first
   * frame, wrong loops and the weakest loops use before others. */
  pictures: Record<string, Picture>;
}

/** A loop of an earlier frame that a later one found, or withdrew. The match is a frame of this
 * run, or session and frame of an earlier session of the map. */
export type LateLoop = [
  frame: number,
  match: number | [session: number, frame: number],
  score: number,
  isWithdrawn: boolean,
];

/** In a plane, m; null for frames whose position is unknown. */
export interface Positions {
  x_m: (number | null)[];
  y_m: (number | null)[];
  axes: [x: string, y: string];
}

/** What the pose graph made of the trajectory, before = by odometry. Loops are flat triples query,
 * match, and 1 if it is kept. */
export interface TrajectoryCorrection {
  before: Positions;
  after: Positions;
  loops: number[];
}

/** In nats; null for frames without a match. */
export interface ScoreTerms {
  votes: (number | null)[];
  geometry: (number | null)[];
  path: (number | null)[];
  rivals: (number | null)[];
  prior: (number | null)[];
}

/** The pose of the query's camera in the frame of the match's (x right, y down, z ahead). */
export interface LoopPose {
  /** Null if it is in an earlier session of the map. */
  match: number | null;
  /** Names as in relative_poses.csv; see docs/poses.md. */
  status: string;
  known: "nothing" | "rotation" | "direction" | "metric";
  scale: string;
  inliers: number;
  points: number;
  /** From here on missing if nothing is known. */
  rms_px?: number;
  rotation_rad?: number;
  rotation_sigma_rad?: number;
  /** Where the query looks. */
  heading?: [x: number, y: number, z: number];
  /** In metres, or of length 1; missing if only the rotation is known. So are its largest standard
   * deviation and its covariance seen from above. */
  translation?: [x: number, y: number, z: number];
  translation_sigma?: number;
  position_from_above?: [xx: number, xz: number, zz: number];
  /** Missing for frames without a picture. */
  epipolar?: EpipolarLine[];
}

/** A point in the query, and where the match may see it: parts of a curve as x, y, x, y ... Each from
 * 0 to 1 of width or height. */
export interface EpipolarLine {
  query: [x: number, y: number];
  match: number[][];
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
  /** Arguments of the command; none if the library made the run. */
  arguments?: string[];
  input: { path: string; description: string; every: number; limit: number };
  /** The map, and the session of this run in it. */
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
  /** With --correct. Errors only if true positions are known. */
  correction?: { odometry_error_m: number | null; corrected_error_m: number | null };
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
  /** The lowest score without a wrong loop at or above it; null if the highest is wrong. */
  score_at_full_precision: number | null;
  average_precision: number;
  pairs: { positives: number; right: number; recall: number };
  curve: CurvePoint[];
}

/** xi of pairs of frames in `side` x `side` cells; a cell has the largest xi compared in it. */
export interface SimilarityMatrix {
  side: number;
  frames_per_cell: number;
  /** Only every N-th frame was compared with every N-th, and each frame with its match. */
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
