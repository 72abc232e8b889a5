// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Bounds, padded } from "./bounds.ts";
import { html, svg } from "./dom.ts";
import * as format from "./format.ts";
import { frameText } from "./frame_text.ts";
import { Path, type Pen } from "./pen.ts";
import { Plot } from "./plot.ts";
import { nearest, type Projection } from "./projection.ts";
import type { Positions, RunRecord } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import type { Theme } from "./theme.ts";
import type { Point } from "./verdicts.ts";
import { caption, section, type View } from "./view.ts";

const placesOf = ({ x_m, y_m }: Positions): (Point | null)[] =>
  x_m.map((x, i) => {
    const y = y_m[i] ?? null;
    return x === null || y === null ? null : { x, y };
  });

/** How far off the trajectory is, where the truth is known. */
function errorText({ correction }: RunRecord): string {
  const before = correction?.odometry_error_m ?? null;
  const after = correction?.corrected_error_m ?? null;
  if (before === null || after === null) return "";
  return ` Absolute trajectory error: ${before.toFixed(2)} m by odometry, ${after.toFixed(2)} m corrected.`;
}

const entry = (kind: string, text: string) =>
  html("li", {}, html("span", { class: `line ${kind}` }), text);

/** The trajectory by odometry and corrected by the pose graph, with the loops that it judged. */
export class Correction implements View {
  readonly element: HTMLElement;
  private readonly caption = caption();
  private readonly legend = html("ul", { class: "legend" });
  private readonly plot: Plot;
  private before: (Point | null)[] = [];
  private after: (Point | null)[] = [];
  private kept: [number, number][] = [];
  private rejected: [number, number][] = [];

  constructor(private readonly store: Store) {
    this.plot = new Plot({
      label: "Correction. The trajectory before and after, with the loops.",
      xLabel: "m",
      yLabel: "m",
      height: (width) => Math.max(280, Math.min(width * 0.62, 560)),
      zoom: "xy",
      equalAxes: true,
      bounds: () => this.bounds(),
      draw: (ctx, to, theme) => this.draw(ctx, to, theme),
      hit: (pixel, to) => {
        const frame = nearest(
          to,
          pixel,
          this.after.length,
          (i) => this.after[i] ?? null,
          () => 0,
        );
        const at = frame === null ? null : this.after[frame];
        return frame === null || !at
          ? null
          : { frame, at, text: frameText(this.store.model, frame) };
      },
      selected: (to) => this.selected(to),
      place: () => this.after[this.store.now.frame] ?? null,
      select: (hit) => this.store.select(hit.frame),
    });
    this.element = section(
      "correction",
      "Corrected trajectory",
      this.caption,
      this.plot.controls(),
      this.legend,
      this.plot.element,
    );
  }

  showRun({ run }: RunModel): void {
    const { correction, record } = run;
    this.element.hidden = !correction;
    if (!correction) return;
    this.before = placesOf(correction.before);
    this.after = placesOf(correction.after);
    this.kept = [];
    this.rejected = [];
    for (let i = 0; i + 2 < correction.loops.length; i += 3) {
      const [query = 0, match = 0, isKept] = correction.loops.slice(i, i + 3);
      (isKept ? this.kept : this.rejected).push([query, match]);
    }
    this.caption.textContent = `By the pose graph of odometry and loops, in metres (${correction.after.axes.join(" and ")}).${record ? errorText(record) : ""}`;
    this.legend.replaceChildren(
      entry("corrected", "corrected"),
      entry("odometry", "odometry"),
      entry("kept", `${format.counted(this.kept.length, "loop")} kept`),
      entry("rejected", `${format.counted(this.rejected.length, "loop")} rejected`),
    );
    this.plot.reset();
  }

  showSelection(_: Selection): void {
    this.plot.follow();
  }

  private bounds(): Bounds {
    const known = [...this.before, ...this.after].filter((place) => place !== null);
    if (known.length === 0) return { x: [-1, 1], y: [-1, 1] };
    const range = (values: number[]) =>
      padded(
        [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))],
        0.06,
      );
    return { x: range(known.map(({ x }) => x)), y: range(known.map(({ y }) => y)) };
  }

  private draw(ctx: Pen, to: Projection, theme: Theme): void {
    ctx.lineJoin = "round";
    ctx.lineWidth = 1.5 * to.ratio;
    ctx.strokeStyle = theme.muted;
    ctx.setLineDash([5 * to.ratio, 4 * to.ratio]);
    ctx.stroke(pathOf(this.before, to));
    ctx.setLineDash([]);
    this.drawLoops(ctx, to, this.kept, theme.loop);
    this.drawLoops(ctx, to, this.rejected, theme.wrong);
    ctx.lineWidth = 2 * to.ratio;
    ctx.strokeStyle = theme.ink;
    ctx.stroke(pathOf(this.after, to));
  }

  private selected(to: Projection): SVGElement[] {
    const { frame } = this.store.now;
    const at = this.after[frame];
    if (!at) return [];
    const place = { cx: to.x(at.x), cy: to.y(at.y) };
    return [svg("circle", { class: "selected", ...place, r: 9, "data-frame": frame })];
  }

  private drawLoops(ctx: Pen, to: Projection, loops: [number, number][], colour: string): void {
    const path = new Path();
    for (const [query, match] of loops) {
      const [from, end] = [this.after[query], this.after[match]];
      if (!from || !end) continue;
      path.moveTo(to.x(from.x), to.y(from.y));
      path.lineTo(to.x(end.x), to.y(end.y));
    }
    ctx.strokeStyle = colour;
    ctx.lineWidth = 1.2 * to.ratio;
    ctx.stroke(path);
  }
}

/** Broken where a place is not known. */
function pathOf(places: readonly (Point | null)[], to: Projection): Path {
  const path = new Path();
  let isDown = false;
  for (const place of places) {
    if (place && isDown) path.lineTo(to.x(place.x), to.y(place.y));
    else if (place) path.moveTo(to.x(place.x), to.y(place.y));
    isDown = place !== null;
  }
  return path;
}
