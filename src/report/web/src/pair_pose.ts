// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html, svg } from "./dom.ts";
import type { LoopPose } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection } from "./store.ts";

const kDegrees = 180 / Math.PI;
/** 95 % of a normal distribution in two dimensions, in standard deviations. */
const kReach95 = 2.45;
const kUnknown: Readonly<Record<string, string>> = {
  few_matches: "too few matches",
  no_geometry: "no pose explains the matches",
  plane: "the points lie on a plane, and two poses explain them",
  ambiguous: "two poses explain the matches",
};

const degrees = (angle: number, sigma: number): string => {
  const digits = sigma * kDegrees < 0.95 ? 2 : 1;
  return `${(angle * kDegrees).toFixed(digits)}° ± ${(sigma * kDegrees).toFixed(digits)}°`;
};

/** Three digits of the uncertainty at most. */
const metres = (length: number, sigma: number): string => {
  const digits = sigma < 0.095 ? 3 : 2;
  return `${length.toFixed(digits)} m ± ${sigma.toFixed(digits)} m`;
};

/** The pose of the pair that is shown, if one was measured. */
export function poseOf(model: RunModel, selection: Selection): LoopPose | null {
  const pose = model.run.poses?.[selection.frame] ?? null;
  return pose !== null && model.partner(selection) === pose.match ? pose : null;
}

/** "34° left of ahead" in the frame of the match's camera, and how far up or down. */
function directionOf([x, y, z]: readonly [number, number, number]): string {
  const aside = Math.atan2(x, z) * kDegrees;
  const up = Math.atan2(-y, Math.hypot(x, z)) * kDegrees;
  const side = `${Math.abs(aside).toFixed(0)}° ${aside < 0 ? "left" : "right"} of ahead`;
  return Math.abs(up) < 5 ? side : `${side}, ${Math.abs(up).toFixed(0)}° ${up < 0 ? "down" : "up"}`;
}

function wordsOf(pose: LoopPose): string[] {
  const { rotation_rad, rotation_sigma_rad, translation, translation_sigma = 0 } = pose;
  if (rotation_rad === undefined || rotation_sigma_rad === undefined) {
    return [`not known: ${kUnknown[pose.status] ?? pose.status}`];
  }
  const words = [`turned by ${degrees(rotation_rad, rotation_sigma_rad)}`];
  if (!translation) {
    const why = pose.status === "pure_rotation" ? "the camera only turned" : "too little parallax";
    return [...words, `no direction: ${why}`];
  }
  if (pose.known === "metric") {
    words.push(`moved ${metres(Math.hypot(...translation), translation_sigma)}`);
    return [...words, directionOf(translation)];
  }
  const sigma = `± ${(translation_sigma * kDegrees).toFixed(1)}°`;
  return [...words, `moved ${directionOf(translation)} ${sigma}`, "distance not known"];
}

/** A camera at `x`, `z` that looks along `dx`, `dz`, as a wedge of the length `size`. */
function cameraAt(kind: string, at: readonly number[], look: readonly number[], size: number) {
  const [x = 0, z = 0] = at;
  const angle = Math.atan2(look[0] ?? 0, look[1] ?? 1);
  const corner = (turn: number) =>
    `${x + size * Math.sin(angle + turn)},${-(z + size * Math.cos(angle + turn))}`;
  return svg("polygon", {
    class: `camera ${kind}`,
    points: `${x},${-z} ${corner(-0.5)} ${corner(0.5)}`,
  });
}

/** Where the query's camera is with a probability of 95 %. */
function ellipseOf(
  [x, z]: readonly [number, number],
  [xx, xz, zz]: readonly [number, number, number],
): SVGEllipseElement {
  const mean = (xx + zz) / 2;
  const half = Math.hypot((xx - zz) / 2, xz);
  const radius = (value: number) => kReach95 * Math.sqrt(Math.max(value, 0));
  const turn = (Math.atan2(2 * xz, xx - zz) / 2) * kDegrees;
  return svg("ellipse", {
    rx: radius(mean + half),
    ry: radius(mean - half),
    transform: `translate(${x} ${-z}) rotate(${-turn})`,
  });
}

/** Both cameras seen from above, the match's looking up. */
function drawingOf({ heading, translation, position_from_above }: LoopPose): SVGSVGElement | null {
  if (!heading) return null;
  const [x, , z] = translation ?? [0, 0, 0];
  const spread = position_from_above ?? [0, 0, 0];
  const reach = kReach95 * Math.sqrt(Math.max(spread[0], spread[2], 0));
  const size = 0.35 * (Math.hypot(x, z) || 1);
  const margin = Math.max(1.2 * size, Math.min(reach, 2 * size));
  const [left, right] = [Math.min(0, x) - margin, Math.max(0, x) + margin];
  const [low, high] = [Math.min(0, z) - margin, Math.max(0, z) + margin];
  const drawing = svg("svg", {
    class: "pose-drawing",
    viewBox: `${left} ${-high} ${right - left} ${high - low}`,
    role: "img",
    "aria-label": "Both cameras seen from above; the ellipse holds the query's with 95 %",
  });
  if (position_from_above) drawing.append(ellipseOf([x, z], spread));
  drawing.append(cameraAt("match", [0, 0], [0, 1], size));
  drawing.append(cameraAt("query", [x, z], [heading[0], heading[2]], size));
  return drawing;
}

/** The relative pose of the pair, in words and seen from above. */
export function pairPose(model: RunModel, selection: Selection): HTMLElement | null {
  const pose = poseOf(model, selection);
  if (!pose) return null;
  const words = html(
    "div",
    { class: "pose-words" },
    html("strong", {}, "relative pose of the query"),
    ...wordsOf(pose).map((text) => html("span", {}, text)),
  );
  const title = `Status ${pose.status}, ${pose.inliers} inliers; see the page on poses`;
  return html("div", { class: "pose", "data-key": "pair.pose", title }, drawingOf(pose), words);
}
