// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Made-up but plausible report data, the same for the same options, for pages to be looked at and
// tested without a detector:
//
//   node sample.mjs --page report.html --out FILE [--frames N] [--runs N] [--pictures-mb MB]
//                   [--no-truth] [--no-poses] [--no-pictures] [--no-loops] [--no-revisits]
//                   [--external] [--unreadable] [--map] [--cut-off] [--slow-frame] [--long-names]
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import {
  contentAt,
  distance_m,
  evidenceAt,
  lap_m,
  pngOf,
  positionAt,
  random,
  similarity,
} from "./sample_world.mjs";

const kTolerance = 4;
const kThreshold = 0.98;
const kMaxSide = 640;
const kMaxCompared = 2048;
/** As cameras give it: seconds since 1970. */
const kStart_s = 1403715273.25;
const kStatuses = [
  "loop",
  "no_earlier_place",
  "no_similar_place",
  "few_matches",
  "no_geometry",
  "low_score",
  "ambiguous",
  "unreachable",
  "unreadable",
];
const kSteps = ["content", "retrieval", "features", "verification"];

const statusOf = (name) => kStatuses.indexOf(name);
const round = (x, digits) => Number(x.toFixed(digits));

/** Two laps and a half, with some swaying. */
function placesOf(frames) {
  return Array.from({ length: frames }, (_, i) => ({
    along_m: (2.4 * lap_m * i) / Math.max(1, frames),
    aside_m: 0.5 * Math.sin(i / 9) + (0.6 * i) / frames,
  }));
}

/** True earlier places: the lap before, within 2.5 m. */
function truthOf(places) {
  const same_place = [];
  const near_place = [];
  const perMetre = places.length / (2.4 * lap_m);
  const reach = Math.max(0, Math.round(2.5 * perMetre));
  const lap = Math.round(lap_m * perMetre);
  for (const [query, { along_m }] of places.entries()) {
    if (along_m < lap_m || lap === 0) continue;
    const first = Math.max(0, query - lap - reach);
    const last = Math.max(first, Math.min(query - 1, query - lap + reach));
    same_place.push(query, first, last);
    near_place.push(query, Math.max(0, first - 2 * reach), last + 2 * reach);
  }
  return { same_place, near_place };
}

const covers = (triples, query, match) => {
  for (let i = 0; i < triples.length; i += 3) {
    if (triples[i] === query && match >= triples[i + 1] && match <= triples[i + 2]) return true;
  }
  return false;
};

/** What a detector of some `quality`, 0 to 1, says. */
function detect(places, quality, options, next) {
  const frames = places.length;
  const lap = Math.round((lap_m * frames) / (2.4 * lap_m));
  const columns = { status: [], match: [], score: [], matches: [], inliers: [] };
  for (let frame = 0; frame < frames; ++frame) {
    const isUnreadable = options.unreadable && frame % 37 === 5;
    const isEarly = frame < Math.max(2, frames / 20);
    const isRevisit = places[frame].along_m > lap_m && !options.noLoops;
    const jitter = Math.round((next() - 0.5) * 0.022 * frames);
    const isAstray = !isRevisit || next() > 0.93 + 0.06 * quality;
    const anywhere = Math.floor(next() * Math.max(1, frame - frames / 20));
    const match = isAstray ? anywhere : Math.max(0, Math.min(frame - 1, frame - lap + jitter));
    const strength =
      isRevisit && !isAstray ? 12 + 60 * quality * next() ** 1.5 + 8 : 15 * next() ** 2;
    const evidence = isAstray && isRevisit && next() < 0.2 ? 19.5 : round(strength, 1);
    // A probability, 0.98 for 18.
    const score = round(1 / (1 + Math.exp((18 - evidence) / 2 - Math.log(49))), 6);
    const isNothing = isUnreadable || isEarly;
    columns.match.push(isNothing ? -1 : match);
    columns.score.push(isNothing ? 0 : score);
    columns.inliers.push(isNothing ? 0 : Math.floor(evidence * 1.1));
    columns.matches.push(isNothing ? 0 : Math.floor(evidence * 1.4 + 8));
    const low = evidence < 4 ? "few_matches" : evidence < 7 ? "no_geometry" : "low_score";
    const judged = score >= kThreshold ? "loop" : low;
    columns.status.push(
      statusOf(isUnreadable ? "unreadable" : isEarly ? "no_earlier_place" : judged),
    );
  }
  const close = columns.status.indexOf(statusOf("low_score"));
  if (close >= 0) columns.score[close] = kThreshold - 0.00004;
  return columns;
}

/** Frames that change the decision of the one before: a late loop, or one that is withdrawn. */
function lateOf({ match, status, score }) {
  const isLoop = (frame) => status[frame] === statusOf("loop");
  let found = false;
  const all = match.map((_, by) => {
    const frame = by - 1;
    if (frame < 0 || match[frame] < 0 || frame % 11 !== 3) return null;
    found = true;
    return [
      [frame, match[frame], isLoop(frame) ? 0.25 : Math.max(0.985, score[frame]), isLoop(frame)],
    ];
  });
  return found ? all : null;
}

/** Terms whose sum is the log odds of the score. */
function termsOf({ match, score }) {
  const of = (term) => score.map((value, i) => (match[i] < 0 ? null : round(term(value), 2)));
  const logOdds = (value) => Math.log(Math.max(value, 1e-6) / Math.max(1 - value, 1e-6));
  return {
    votes: of((value) => 0.4 * logOdds(value)),
    geometry: of((value) => 0.6 * logOdds(value) + 3),
    path: of(() => 7),
    rivals: of(() => -0.5),
    prior: of(() => -9.5),
  };
}

/** The later half of the run is in a place that an earlier session of the map knows. */
function sendElsewhere(columns) {
  columns.earlier_match = columns.match.map(() => null);
  for (let frame = Math.floor(columns.match.length / 2); frame < columns.match.length; ++frame) {
    if (columns.match[frame] < 0 || frame % 3 === 0) continue;
    columns.earlier_match[frame] = [1, columns.match[frame] + 1000];
    columns.match[frame] = -1;
  }
}

function verdictsOf(columns, truth) {
  return columns.match.map((match, frame) => {
    const isLoop = columns.status[frame] === statusOf("loop");
    if (!truth) return isLoop ? "loop" : "none";
    if (isLoop && match < 0) return "elsewhere";
    const isRight = isLoop && covers(truth.same_place, frame, match);
    const isNear = isLoop && covers(truth.near_place, frame, match);
    if (isRight) return "right";
    if (isLoop && !isNear) return "wrong";
    if (truth.same_place.some((query, i) => i % 3 === 0 && query === frame)) return "missed";
    return isLoop ? "tolerated" : "none";
  });
}

/** Loops whose queries and matches are at most 20 frames from those before. */
function revisitsOf({ status, match }) {
  const revisits = [];
  for (const [frame, one] of status.entries()) {
    if (one !== statusOf("loop") || match[frame] < 0) continue;
    const last = revisits.findLast(
      ({ query, match: to }) => frame - query[1] <= 20 && Math.abs(match[frame] - to[1]) <= 20,
    );
    if (last) {
      last.query[1] = frame;
      last.match[1] = match[frame];
      ++last.loops;
    } else {
      revisits.push({ query: [frame, frame], match: [match[frame], match[frame]], loops: 1 });
    }
  }
  return revisits;
}

/** A wrong loop, otherwise the strongest loop of this run, otherwise a missed revisit. */
function firstFrameOf({ status, match, score }, verdicts) {
  const wrong = verdicts.indexOf("wrong");
  if (wrong >= 0) return wrong;
  const loops = status.flatMap((one, frame) =>
    one === statusOf("loop") && match[frame] >= 0 ? [frame] : [],
  );
  if (loops.length > 0) return loops.reduce((a, b) => (score[b] > score[a] ? b : a));
  return Math.max(0, verdicts.indexOf("missed"));
}

function wilson(hits, trials) {
  if (trials === 0) return [0, 1];
  const z = 1.959963984540054;
  const scale = 1 / (1 + (z * z) / trials);
  const p = hits / trials;
  const half = scale * z * Math.sqrt((p * (1 - p)) / trials + (z * z) / (4 * trials * trials));
  const middle = scale * (p + (z * z) / (2 * trials));
  return [Math.max(0, middle - half), Math.min(1, middle + half)];
}

function curveOf(columns, truth, positives) {
  const ranked = columns.match
    .map((match, frame) => ({ frame, match, score: columns.score[frame] }))
    .filter(({ match }) => match >= 0)
    .sort((a, b) => b.score - a.score);
  const curve = [];
  let right = 0;
  let wrong = 0;
  for (const [i, { frame, match, score }] of ranked.entries()) {
    if (covers(truth.same_place, frame, match)) ++right;
    else if (!covers(truth.near_place, frame, match)) ++wrong;
    if (ranked[i + 1]?.score === score) continue;
    const precision = right + wrong === 0 ? 1 : right / (right + wrong);
    curve.push({ score, right, wrong, precision, recall: positives === 0 ? 0 : right / positives });
  }
  return curve;
}

function evaluationOf(columns, verdicts, truth) {
  const revisits = truth.same_place.filter((_, i) => i % 3 === 0);
  const positives = revisits.filter((query) => verdicts[query] !== "elsewhere").length;
  const tally = (name) => verdicts.filter((verdict) => verdict === name).length;
  const [right, wrong] = ["right", "wrong"].map(tally);
  const isNear = (frame) =>
    columns.status[frame] === statusOf("loop") && ["tolerated", "missed"].includes(verdicts[frame]);
  const tolerated = verdicts.filter((_, frame) => isNear(frame)).length;
  const curve = curveOf(columns, truth, positives);
  const full = curve.filter((point) => point.wrong === 0).at(-1);
  let before = 0;
  let average_precision = 0;
  for (const { precision, recall } of curve) {
    average_precision += precision * (recall - before);
    before = recall;
  }
  const pairs = truth.same_place.reduce(
    (sum, last, i, t) => (i % 3 === 2 ? sum + last - t[i - 1] + 1 : sum),
    0,
  );
  return {
    protocol: null,
    positives,
    right,
    tolerated,
    wrong,
    ignored: tally("elsewhere"),
    recall: positives === 0 ? 0 : right / positives,
    precision: right + wrong === 0 ? 1 : right / (right + wrong),
    precision_interval: wilson(right, right + wrong),
    recall_at_full_precision: full?.recall ?? 0,
    score_at_full_precision: full?.score ?? null,
    average_precision,
    pairs: {
      positives: pairs,
      right,
      wrong,
      recall: pairs === 0 ? 0 : right / pairs,
      precision: 1,
    },
    curve,
  };
}

/** `slowest_ms`: what one of the frames waits for its features. */
function timesOf(frames, slowness, next, slowest_ms) {
  const tail = () => 1 + (next() < 0.03 ? 1.2 * next() : 0.15 * next());
  const of = (base, growth) =>
    Array.from({ length: frames }, (_, i) =>
      round((base + (growth * i) / frames) * slowness * tail(), 3),
    );
  const times = {
    content: of(0.4, 0),
    retrieval: of(0.02, 0.5),
    features: of(14, 0),
    verification: of(1, 13),
  };
  if (slowest_ms > 0) times.features[frames >> 1] = slowest_ms;
  return times;
}

function summaryOf(times) {
  const sorted = [...times].sort((a, b) => a - b);
  const at = (q) => sorted[Math.ceil(q * sorted.length) - 1] ?? 0;
  const mean = sorted.reduce((sum, time) => sum + time, 0) / Math.max(1, sorted.length);
  return { mean, p50: at(0.5), p99: at(0.99), max: at(1) };
}

function recordOf(columns, times, frames, options) {
  const readable = (of) =>
    of.filter((_, frame) => columns.status[frame] !== statusOf("unreadable"));
  const total = times.content.map((_, i) => kSteps.reduce((sum, step) => sum + times[step][i], 0));
  const all = Object.fromEntries(kSteps.map((step) => [step, summaryOf(readable(times[step]))]));
  const by_status = Object.fromEntries(
    kStatuses.map((name, i) => [name, columns.status.filter((status) => status === i).length]),
  );
  const wall_s = (total.reduce((sum, time) => sum + time, 0) / 1000) * 1.1;
  const results = {
    counts: { frames, by_status },
    times_ms: { ...all, total: summaryOf(readable(total)) },
    wall_s,
    frames_per_s: frames / wall_s,
    peak_memory_mib: 180.4,
  };
  return {
    loopbit: "0.1.0",
    arguments: options.map ? kMapArguments : [],
    input: {
      path: "street/images",
      description: `${frames} images in street/images`,
      every: 2,
      limit: 0,
    },
    stopped_by: options.cutOff ? "running" : "end",
    ...(options.map ? { map: { path: "street.db", session: 2 } } : {}),
    options: {
      binary_content: { gamma: 1.5, blur_sigma_px: 2.5 },
      retrieval: { shift_tolerance_columns: kTolerance, top_k: 20, min_similarity: 0.2 },
      surf: { max_keypoints: 700, upright: true },
      decision: { min_score: kThreshold },
    },
    machine: {
      processor: "A made-up processor",
      cores: 2,
      kernel: "avx2",
      system: "Linux 6.1.0 x86_64",
    },
    threads: 1,
    ...(options.cutOff ? {} : results),
  };
}

/** With words that the shell would split or change. */
const kMapArguments = [
  "run",
  "street/images",
  "--truth",
  "it's $HOME/truth.csv",
  "--out",
  "first run",
  "--overwrite",
  "--set",
  "surf.max_keypoints=700",
  "--map",
  "street.db",
];

/** Places, contents and matrices by the number of frames, which is all that they depend on. */
const madePlaces = new Map();
const madeContents = new Map();
const madeMatrices = new Map();
const madeOnce = (made, frames, make) => {
  if (!made.has(frames)) made.set(frames, make());
  return made.get(frames);
};

/** By contents for few frames, by distance along the street for many. */
function matrixOf(places, contents) {
  const frames_per_cell = Math.max(1, Math.ceil(places.length / kMaxSide));
  const side = Math.ceil(places.length / frames_per_cell);
  const grey = new Uint8Array(side * side);
  for (let row = 0; row < side; ++row) {
    for (let column = 0; column < row; ++column) {
      const [later, earlier] = [row * frames_per_cell, column * frames_per_cell];
      const apart = distance_m(places[later].along_m, places[earlier].along_m);
      const xi = contents
        ? similarity(contents[later], contents[earlier], kTolerance)
        : 0.25 + 0.6 * Math.exp(-apart / 2) + 0.05 * Math.sin(later / 50) * Math.cos(earlier / 30);
      grey[row * side + column] = Math.round(255 * Math.min(1, xi));
    }
  }
  const compared_every = Math.max(1, Math.ceil(places.length / kMaxCompared));
  return { side, frames_per_cell, compared_every, png: pngOf(grey, side, side) };
}

/** Frames with their partners until `budget` bytes are full, spread over the run. */
function picturesOf(places, columns, truth, budget) {
  const pictures = {};
  let bytes = 0;
  const add = (frame) => {
    if (frame < 0 || pictures[frame]) return;
    const match = columns.match[frame];
    const picture = evidenceAt(places[frame], match < 0 ? null : places[match]);
    bytes += Object.values(picture).reduce((sum, text) => sum + (text?.length ?? 0), 70);
    if (bytes <= budget) pictures[frame] = picture;
  };
  for (let i = 0; i < places.length && bytes < budget; ++i) {
    const frame = (i * 7919) % places.length;
    if (columns.status[frame] === statusOf("unreadable")) continue;
    add(frame);
    add(columns.match[frame]);
  }
  for (let i = 0; truth && i < truth.same_place.length && bytes < budget; i += 3) {
    add(Math.floor((truth.same_place[i + 1] + truth.same_place[i + 2]) / 2));
  }
  return pictures;
}

function runOf(places, index, options) {
  const next = random(100 + index);
  const frames = places.length;
  const isExternal = options.external && index === options.runs - 1;
  const columns = detect(places, 1 - 0.35 * index, options, next);
  if (options.map) sendElsewhere(columns);
  const listed = options.noRevisits ? { same_place: [], near_place: [] } : truthOf(places);
  const truth = options.truth ? { ...listed, source: options.map ? "a list" : null } : null;
  const verdict = verdictsOf(columns, truth);
  const times_ms = isExternal
    ? null
    : timesOf(frames, 1 + 0.4 * index, next, options.slowFrame ? 1e4 : 0);
  const hasContents = options.pictures && !isExternal;
  const contents = madeOnce(madeContents, frames, () => places.map(contentAt));
  const matrix = () => matrixOf(places, frames <= 400 ? contents : null);
  const similarityOf = (match, frame) =>
    match < 0 ? 0 : similarity(contents[frame], contents[match], kTolerance);
  const positions = places.map(positionAt);
  const name = isExternal
    ? "another detector"
    : ["street", "street, fewer keypoints", "street, third"][index];
  return {
    name: options.longNames ? `${name}, ${"as_careful_people_call_it".repeat(4)}` : name,
    record: isExternal ? null : recordOf(columns, times_ms, frames, options),
    threshold: isExternal ? null : kThreshold,
    frames,
    frames_known: !isExternal || options.poses || options.runs > 1,
    names: isExternal ? null : places.map((_, i) => `${String(2 * i).padStart(6, "0")}.png`),
    timestamp_s: isExternal ? null : places.map((_, i) => round(kStart_s + i * 0.1, 6)),
    status_names: isExternal ? ["loop", "no_loop"] : kStatuses,
    status: isExternal ? columns.status.map((status) => (status === 0 ? 0 : 1)) : columns.status,
    match: columns.match,
    earlier_match: columns.earlier_match ?? null,
    score: isExternal
      ? columns.score.map((score, frame) => (columns.match[frame] < 0 ? null : score))
      : columns.score,
    late_loops: isExternal ? null : lateOf(columns),
    terms: isExternal ? null : termsOf(columns),
    similarity: isExternal
      ? null
      : columns.match.map((match, frame) => round(similarityOf(match, frame), 6)),
    matches: isExternal ? null : columns.matches,
    inliers: isExternal ? null : columns.inliers,
    times_ms,
    verdict,
    first_frame: firstFrameOf(columns, verdict),
    revisits: revisitsOf(columns),
    truth,
    evaluation: truth ? evaluationOf(columns, verdict, truth) : null,
    positions: options.poses
      ? {
          x_m: positions.map(({ x }) => round(x, 4)),
          y_m: positions.map(({ y }) => round(y, 4)),
          axes: ["x", "z"],
        }
      : null,
    correction: options.poses && !isExternal ? correctionOf(positions, columns) : null,
    similarity_matrix: hasContents ? madeOnce(madeMatrices, frames, matrix) : null,
    poses: options.poses && !isExternal ? relativePosesOf(columns) : null,
    pictures: hasContents
      ? picturesOf(places, columns, truth, (1e6 * options.picturesMb) / options.runs)
      : {},
  };
}

/** By an odometry that drifts to the right; every seventh loop is rejected. */
function correctionOf(positions, { status, match }) {
  const at = (drift) => ({
    x_m: positions.map(({ x }, i) => round(x + drift * i, 4)),
    y_m: positions.map(({ y }) => round(y, 4)),
    axes: ["x", "z"],
  });
  const loops = match.flatMap((place, query) =>
    status[query] === 0 && place >= 0 && query % 11 !== 3
      ? [query, place, query % 7 === 0 ? 0 : 1]
      : [],
  );
  return { before: at(0.05), after: at(0), loops };
}

/** A pose of every kind in turn, of the loops within the run. */
function relativePosesOf({ status, match }) {
  const poses = {};
  for (const [query, place] of match.entries()) {
    if (status[query] !== 0 || place < 0) continue;
    const known = ["metric", "direction", "rotation", "nothing"][query % 4];
    const pose = {
      match: place,
      status: "measured",
      known,
      scale: "known",
      inliers: 60,
      points: 50,
    };
    poses[query] = pose;
    if (known === "rotation") pose.status = "pure_rotation";
    if (known === "nothing") pose.status = "ambiguous";
    if (known === "nothing") continue;
    const turn = 0.2 * Math.sin(query);
    Object.assign(pose, { rms_px: 0.5, rotation_rad: Math.abs(turn), rotation_sigma_rad: 0.003 });
    pose.heading = [Math.sin(turn), 0, Math.cos(turn)];
    if (known === "rotation") continue;
    const length = known === "metric" ? 1.5 : 1;
    pose.translation = [length * Math.sin(query), 0, length * Math.cos(query)];
    pose.translation_sigma = 0.04;
    pose.position_from_above = [0.0016, 0.0004, 0.0009];
    pose.epipolar = [0.3, 0.7].map((x) => ({ query: [x, 0.5], match: [[x, 0.1, x + 0.1, 0.9]] }));
  }
  return poses;
}

const kDefaults = {
  frames: 240,
  runs: 1,
  truth: true,
  poses: true,
  pictures: true,
  noLoops: false,
  noRevisits: false,
  external: false,
  unreadable: false,
  map: false,
  cutOff: false,
  slowFrame: false,
  longNames: false,
  picturesMb: 12,
};

/** The ReportData of src/report/web/src/report_data.ts. */
export function sampleData(wanted = {}) {
  const options = { ...kDefaults, ...wanted };
  const places = madeOnce(madePlaces, options.frames, () => placesOf(options.frames));
  const runs = Array.from({ length: options.runs }, (_, i) => runOf(places, i, options));
  return { loopbit: "0.1.0", runs };
}

/** The page with its data, as src/report/report.cpp puts it in. */
export function pageWith(page, data) {
  return page.split("@REPORT_DATA@").join(JSON.stringify(data).replaceAll("<", "\\u003c"));
}

function main(args) {
  const flag = (name) => args.includes(name);
  const value = (name, otherwise) => (flag(name) ? args[args.indexOf(name) + 1] : otherwise);
  const page = readFileSync(value("--page", "dist/report.html"), "utf8");
  const data = sampleData({
    frames: Number(value("--frames", kDefaults.frames)),
    runs: Number(value("--runs", kDefaults.runs)),
    truth: !flag("--no-truth"),
    poses: !flag("--no-poses"),
    pictures: !flag("--no-pictures"),
    noLoops: flag("--no-loops"),
    noRevisits: flag("--no-revisits"),
    external: flag("--external"),
    unreadable: flag("--unreadable"),
    map: flag("--map"),
    cutOff: flag("--cut-off"),
    slowFrame: flag("--slow-frame"),
    longNames: flag("--long-names"),
    picturesMb: Number(value("--pictures-mb", kDefaults.picturesMb)),
  });
  writeFileSync(value("--out", "sample.html"), pageWith(page, data));
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) main(process.argv.slice(2));
