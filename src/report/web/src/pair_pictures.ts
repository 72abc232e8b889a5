// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { bytesOf } from "./content.ts";
import { html, svg } from "./dom.ts";
import { poseOf } from "./pair_pose.ts";
import { absenceOf, partnerAbsence, partnerName } from "./partner.ts";
import type { EpipolarLine } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import { type Figure, figureOf } from "./save.ts";
import type { Selection } from "./store.ts";

/** Gap between the two pictures, as a share of the width of one. */
const kGap = 0.02;
/** Wider pictures are stacked vertically. */
const kWide = 1.9;
const kManyLines = 40;
const kCrowd = 120;
/** Radius of an inlier, as a share of the width of a picture. */
const kDot = 0.009;
const kWidth_px = 640;

/** Query and partner side by side, and the inlier matches as lines from one to the other. */
export class PairPictures {
  readonly element = html("div", { class: "pictures", role: "img" });
  private shown = 0;

  figure(): Figure | null {
    return drawingOf(this.element);
  }

  /** `lines`: the inliers, epipolar lines, or nothing. */
  async show(model: RunModel, selection: Selection, lines: "inliers" | "epipolar" | null) {
    const turn = ++this.shown;
    const { frame } = selection;
    const [query, partner] = await Promise.all([
      load(model, frame),
      load(model, model.partner(selection)),
    ]);
    if (turn !== this.shown) return;
    const aspect = aspectOf(query) ?? aspectOf(partner) ?? 0.75;
    const partnerAspect = aspectOf(partner) ?? aspect;
    const isStacked = 1 / Math.min(aspect, partnerAspect) > kWide;
    this.element.classList.toggle("stacked", isStacked);
    const isDrawn = model.isWithCandidate(selection) && query && partner;
    const inliers = isDrawn && lines === "inliers" ? inliersOf(model, frame) : new Float32Array();
    const name = partnerName(model, selection);
    this.element.setAttribute(
      "aria-label",
      `Query ${frame} and ${name}, ${inliers.length / 4} inlier matches drawn.`,
    );
    const beside = model.partner(selection);
    this.element.replaceChildren(
      framed(query, aspect, `query ${frame}`, model.name(frame), absenceOf(model, frame)),
      framed(
        partner,
        partnerAspect,
        name,
        beside === null ? null : model.name(beside),
        partnerAbsence(model, selection),
      ),
    );
    if (inliers.length > 0) {
      const mark = model.mark(frame) ?? "none";
      this.element.append(linesOf(inliers, aspect, partnerAspect, isStacked, mark));
    }
    const epipolar = poseOf(model, selection)?.epipolar ?? [];
    if (lines === "epipolar" && query && partner && epipolar.length > 0) {
      this.element.append(epipolarOf(epipolar, aspect, partnerAspect, isStacked));
    }
  }
}

/** What is shown, as a drawing of which each picture is `kWidth_px` wide; null without a picture. */
function drawingOf(element: HTMLElement): Figure | null {
  const whole = element.getBoundingClientRect();
  const images = [...element.querySelectorAll("img")];
  if (images.length === 0) return null;
  const scale = kWidth_px / (images[0]?.getBoundingClientRect().width ?? 1);
  const content = images.map((image) => {
    const box = image.getBoundingClientRect();
    const [x, y] = [scale * (box.left - whole.left), scale * (box.top - whole.top)];
    const size = `width="${scale * box.width}" height="${scale * box.height}"`;
    return `<image x="${x}" y="${y}" ${size} href="${image.src}"></image>`;
  });
  const [width, height] = [Math.round(scale * whole.width), Math.round(scale * whole.height)];
  const lines = element.querySelector("svg.inliers, svg.epipolar");
  if (lines) {
    const colour = getComputedStyle(lines).getPropertyValue("--line").trim();
    const view = `viewBox="${lines.getAttribute("viewBox")}" preserveAspectRatio="none"`;
    const style = `fill="${colour}" stroke="${colour}" stroke-width="0.002"`;
    content.push(
      `<svg ${view} width="${width}" height="${height}" ${style}>${lines.innerHTML}</svg>`,
    );
  }
  return figureOf(width, height, content.join("\n"), "sans-serif");
}

async function load(model: RunModel, frame: number | null): Promise<HTMLImageElement | null> {
  const picture = frame === null ? undefined : model.run.pictures[frame];
  if (!picture) return null;
  const image = html("img", { alt: "" });
  image.src = `data:image/jpeg;base64,${picture.jpeg}`;
  try {
    await image.decode();
  } catch {
    return null;
  }
  return image;
}

const aspectOf = (image: HTMLImageElement | null) =>
  image && image.naturalWidth > 0 ? image.naturalHeight / image.naturalWidth : null;

/** x, y in the query and x, y in the match, each from 0 to 1. */
function inliersOf(model: RunModel, frame: number): Float32Array {
  const text = model.run.pictures[frame]?.inliers;
  if (!text) return new Float32Array();
  const bytes = bytesOf(text);
  const data = new DataView(bytes.buffer);
  return Float32Array.from({ length: 4 * Math.floor(bytes.length / 16) }, (_, i) =>
    data.getFloat32(4 * i, true),
  );
}

function framed(
  image: HTMLImageElement | null,
  aspect: number,
  tag: string,
  name: string | null,
  absence: string,
): HTMLElement {
  const box = html("div", { class: "picture" });
  box.style.aspectRatio = `${1 / aspect}`;
  box.append(image ?? html("p", { class: "absent" }, absence));
  box.append(html("span", { class: "tag" }, tag));
  if (name !== null) box.append(html("span", { class: "tag name", title: name }, name));
  return box;
}

/** A drawing over both pictures, and where the second one begins; the first is 1 wide. */
function overlay(kind: string, aspect: number, partnerAspect: number, isStacked: boolean) {
  const size = isStacked
    ? [1, aspect + partnerAspect + kGap]
    : [2 + kGap, Math.max(aspect, partnerAspect)];
  const [dx, dy] = isStacked ? [0, aspect + kGap] : [1 + kGap, 0];
  const drawing = svg("svg", {
    class: kind,
    viewBox: `0 0 ${size.join(" ")}`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  return { drawing, dx, dy };
}

/** Points of the query, and in the same colour where the match may see them. */
function epipolarOf(
  lines: readonly EpipolarLine[],
  aspect: number,
  partnerAspect: number,
  isStacked: boolean,
): SVGSVGElement {
  const { drawing, dx, dy } = overlay("epipolar", aspect, partnerAspect, isStacked);
  for (const [i, { query, match }] of lines.entries()) {
    const colour = `hsl(${Math.round((360 * i) / lines.length)} 90% 60%)`;
    const [cx, cy] = [query[0], query[1] * aspect];
    drawing.append(svg("circle", { cx, cy, r: kDot, fill: colour }));
    for (const part of match) {
      const points = Array.from({ length: part.length / 2 }, (_, k) => {
        const [x = 0, y = 0] = part.slice(2 * k, 2 * k + 2);
        return `${x + dx},${y * partnerAspect + dy}`;
      });
      drawing.append(svg("polyline", { points: points.join(" "), stroke: colour }));
    }
  }
  return drawing;
}

function linesOf(
  inliers: Float32Array,
  aspect: number,
  partnerAspect: number,
  isStacked: boolean,
  mark: string,
): SVGSVGElement {
  const count = inliers.length / 4;
  const density = `${count > kManyLines ? " many" : ""}${count > kCrowd ? " crowd" : ""}`;
  const r = count > kCrowd ? 0.7 * kDot : kDot;
  const kind = `inliers ${mark}${density}`;
  const { drawing, dx, dy } = overlay(kind, aspect, partnerAspect, isStacked);
  for (let i = 0; i + 3 < inliers.length; i += 4) {
    const [x1, y1, x2, y2] = inliers.subarray(i, i + 4) as unknown as [
      number,
      number,
      number,
      number,
    ];
    const ends = { x1, y1: y1 * aspect, x2: x2 + dx, y2: y2 * partnerAspect + dy };
    drawing.append(svg("line", ends));
    drawing.append(svg("circle", { cx: ends.x1, cy: ends.y1, r }));
    drawing.append(svg("circle", { cx: ends.x2, cy: ends.y2, r }));
  }
  return drawing;
}
