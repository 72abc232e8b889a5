// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Bounds, padded } from "./bounds.ts";
import { button, html, svg } from "./dom.ts";
import * as format from "./format.ts";
import { ringOf } from "./frame_ring.ts";
import { frameText } from "./frame_text.ts";
import { legend } from "./legend.ts";
import { Path, type Pen } from "./pen.ts";
import { Plot } from "./plot.ts";
import { nearest, type Projection } from "./projection.ts";
import type { Revisit } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import type { Theme } from "./theme.ts";
import { drawMarks, kMarked, markRadius, type Point } from "./verdicts.ts";
import { caption, section, type View } from "./view.ts";

/** A marked frame wins over a slightly nearer point of the path. */
const kMarkedFirst_px = -6;
const kCurveSteps = 10;
const kManyLoops = 1500;

const kListed = 8;

const spanText = ([a, b]: readonly [number, number]) => (a === b ? `${a}` : `${a}–${b}`);

/** The trajectory with its loops; without positions the frames on a ring. */
export class Trajectory implements View {
  readonly element: HTMLElement;
  private readonly caption = caption();
  private readonly title = html("span");
  private readonly legend = legend();
  private readonly revisits = html("ul", { class: "revisits", "aria-label": "Revisits" });
  private readonly plot: Plot;
  private isRing = false;
  private places: (Point | null)[] = [];

  constructor(private readonly store: Store) {
    this.plot = new Plot({
      label: "Loops. Frames with their loops, on the trajectory or on a ring.",
      xLabel: "m",
      yLabel: "m",
      height: (width) => Math.max(280, Math.min(width * 0.62, 560)),
      zoom: "xy",
      equalAxes: true,
      hideAxes: () => this.isRing,
      bounds: () => this.bounds(),
      draw: (ctx, to, theme) => this.draw(ctx, to, theme),
      hit: (pixel, to) => {
        const frame = this.frameAt(pixel, to);
        const at = frame === null ? null : this.places[frame];
        return frame === null || !at
          ? null
          : { frame, at, text: frameText(this.store.model, frame) };
      },
      selected: (to) => this.selected(to),
      place: () => this.places[this.store.now.frame] ?? null,
      select: (hit) => this.store.select(hit.frame),
    });
    this.element = section(
      "trajectory",
      this.title,
      this.caption,
      this.plot.controls(),
      this.legend.element,
      this.plot.element,
      this.revisits,
    );
  }

  showRun(model: RunModel): void {
    const { positions, frames } = model.run;
    this.isRing = positions === null;
    this.places = positions
      ? positions.x_m.map((x, i) => {
          const y = positions.y_m[i] ?? null;
          return x === null || y === null ? null : { x, y };
        })
      : ringOf(frames);
    this.title.textContent = positions ? "Trajectory" : "Loops";
    this.caption.textContent = positions
      ? `The trajectory in metres, in the plane of its largest extent (${positions.axes.join(" and ")}). A line connects each query with its match. Click a frame to see its pair.`
      : "The frames on a ring, clockwise from the top. A band connects the frames of a revisit with their matches, a line a single loop. --poses FILE shows the trajectory.";
    if (model.loopsElsewhere().length > 0) {
      this.caption.append(
        " A loop into another session has no line, because its match is not one of these frames.",
      );
    }
    if (model.lateLoops().length > 0) this.caption.append(" Dashed lines are late loops.");
    this.element.classList.toggle("ring", this.isRing);
    this.legend.show(model);
    this.listRevisits(model);
    this.plot.reset();
  }

  /** The longest revisits, in order. */
  private listRevisits({ run }: RunModel): void {
    const longest = [...run.revisits].sort((a, b) => b.loops - a.loops).slice(0, kListed);
    const others = run.revisits.length - longest.length;
    const entries = run.revisits
      .filter((revisit) => longest.includes(revisit))
      .map(({ query, match, loops }) => {
        const text = `${spanText(query)} is ${spanText(match)}`;
        const title = `${format.counted(loops, "loop")}; show the first`;
        return html(
          "li",
          {},
          button({ title }, () => this.store.select(query[0]), text),
        );
      });
    if (others > 0)
      entries.push(html("li", {}, `and ${format.counted(others, "shorter revisit")}`));
    this.revisits.replaceChildren(...entries);
    this.revisits.hidden = entries.length === 0;
  }

  showSelection(_: Selection): void {
    this.plot.follow();
  }

  private bounds(): Bounds {
    const x: number[] = [];
    const y: number[] = [];
    for (const place of this.places) {
      if (!place) continue;
      x.push(place.x);
      y.push(place.y);
    }
    if (x.length === 0) return { x: [-1, 1], y: [-1, 1] };
    const range = (values: number[]) =>
      padded(
        [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))],
        0.06,
      );
    return { x: range(x), y: range(y) };
  }

  private draw(ctx: Pen, to: Projection, theme: Theme): void {
    this.drawPath(ctx, to, theme);
    const model = this.store.model;
    const count = model.framesIn("loops").length + model.framesIn("missed").length;
    const radius = markRadius(count) * to.ratio;
    if (this.isRing) this.drawBands(ctx, to, theme);
    for (const verdict of kMarked) {
      this.drawLoops(ctx, to, theme, verdict, count);
    }
    this.drawLateLoops(ctx, to, theme, count);
    for (const verdict of kMarked) {
      const points: Point[] = [];
      for (const frame of model.framesMarked(verdict)) {
        const place = this.places[frame];
        if (place) points.push({ x: to.x(place.x), y: to.y(place.y) });
      }
      drawMarks(ctx, verdict, points, radius, theme);
    }
    this.drawEnds(ctx, to, theme);
  }

  private drawPath(ctx: Pen, to: Projection, theme: Theme): void {
    const path = new Path();
    let isDown = false;
    for (const place of this.places) {
      if (place && isDown) path.lineTo(to.x(place.x), to.y(place.y));
      else if (place) path.moveTo(to.x(place.x), to.y(place.y));
      isDown = place !== null;
    }
    ctx.strokeStyle = theme.path;
    ctx.lineWidth = 2 * to.ratio;
    ctx.lineJoin = "round";
    ctx.stroke(path);
  }

  private drawLoops(
    ctx: Pen,
    to: Projection,
    theme: Theme,
    verdict: (typeof kMarked)[number],
    count: number,
  ): void {
    const model = this.store.model;
    const path = new Path();
    for (const frame of model.loopsMarked(verdict)) {
      if (this.isRing && verdict !== "wrong" && model.isInLongRevisit(frame)) continue;
      const from = this.places[frame];
      const match = this.places[model.match(frame) ?? -1];
      if (from && match) this.addLink(path, to, from, match, count);
    }
    ctx.strokeStyle = theme[verdict];
    ctx.globalAlpha = verdict === "wrong" ? 0.9 : Math.max(0.15, 0.6 - count / 4000);
    ctx.lineWidth = (verdict === "wrong" ? 1.5 : 1.1) * to.ratio;
    ctx.stroke(path);
    ctx.globalAlpha = 1;
  }

  private drawLateLoops(ctx: Pen, to: Projection, theme: Theme, count: number): void {
    const path = new Path();
    for (const [frame, matched] of this.store.model.lateLoops()) {
      const from = this.places[frame];
      const match = this.places[matched];
      if (from && match) this.addLink(path, to, from, match, count);
    }
    ctx.strokeStyle = theme.loop;
    ctx.lineWidth = 1.1 * to.ratio;
    ctx.setLineDash([4 * to.ratio, 3 * to.ratio]);
    ctx.stroke(path);
    ctx.setLineDash([]);
  }

  /** Long revisits as bands from their queries to their matches. */
  private drawBands(ctx: Pen, to: Projection, theme: Theme): void {
    const model = this.store.model;
    const colour = model.run.evaluation ? theme.right : theme.loop;
    ctx.fillStyle = colour;
    ctx.strokeStyle = colour;
    ctx.lineWidth = to.ratio;
    for (const revisit of model.longRevisits) {
      const band = this.bandOf(revisit, to);
      ctx.globalAlpha = 0.22;
      ctx.fill(band);
      ctx.globalAlpha = 0.7;
      ctx.stroke(band);
    }
    ctx.globalAlpha = 1;
  }

  /** Along the ring and across it, and back. */
  private bandOf({ query, match }: Revisit, to: Projection): Path {
    const path = new Path();
    const along = ([a, b]: readonly [number, number]) => {
      const step = a <= b ? 1 : -1;
      for (let frame = a; frame !== b + step; frame += step) {
        const place = this.places[frame];
        if (place) path.lineTo(to.x(place.x), to.y(place.y));
      }
    };
    const across = (a: number, b: number) => {
      const [from, end] = [this.places[a], this.places[b]];
      if (from && end) this.addCurve(path, to, from, end, kCurveSteps);
    };
    const begin = this.places[query[0]];
    if (begin) path.moveTo(to.x(begin.x), to.y(begin.y));
    along(query);
    across(query[1], match[1]);
    along([match[1], match[0]]);
    across(match[0], query[0]);
    return path;
  }

  /** Straight in the plane; curved towards the centre on the ring, so that chords separate. */
  private addLink(path: Path, to: Projection, from: Point, match: Point, count: number): void {
    path.moveTo(to.x(from.x), to.y(from.y));
    this.addCurve(path, to, from, match, this.isRing && count < kManyLoops ? kCurveSteps : 1);
  }

  private addCurve(path: Path, to: Projection, from: Point, match: Point, steps: number): void {
    const bend = Math.min(1, Math.hypot(match.x - from.x, match.y - from.y));
    for (let step = 1; step <= steps; ++step) {
      const t = step / steps;
      const pull = steps === 1 ? 1 : 1 - bend * t * (1 - t);
      const x = (from.x + (match.x - from.x) * t) * pull;
      const y = (from.y + (match.y - from.y) * t) * pull;
      path.lineTo(to.x(x), to.y(y));
    }
  }

  private drawEnds(ctx: Pen, to: Projection, theme: Theme): void {
    const known = this.places.filter((place) => place !== null);
    const ends: [Point | undefined, string][] = [
      [known[0], "start"],
      [known.at(-1), "end"],
    ];
    ctx.font = `${12 * to.ratio}px ${theme.font}`;
    ctx.lineWidth = 4 * to.ratio;
    for (const [place, name] of known.length > 1 ? ends : ends.slice(0, 1)) {
      if (!place) continue;
      const away = name === "start" ? 1 : -1;
      const x = to.x(place.x) + 9 * away * to.ratio;
      const y = to.y(place.y) - 9 * to.ratio;
      ctx.textAlign = away > 0 ? "left" : "right";
      ctx.strokeStyle = theme.paper;
      ctx.fillStyle = theme.muted;
      ctx.strokeText(name, x, y);
      ctx.fillText(name, x, y);
    }
  }

  private frameAt(pixel: Point, to: Projection): number | null {
    const model = this.store.model;
    return nearest(
      to,
      pixel,
      this.places.length,
      (frame) => this.places[frame] ?? null,
      (frame) => (model.mark(frame) ? kMarkedFirst_px : 0),
    );
  }

  private selected(to: Projection): SVGElement[] {
    const { frame } = this.store.now;
    const partner = this.store.model.partner(this.store.now);
    const marks: SVGElement[] = [];
    const from = this.places[frame];
    const match = partner === null ? undefined : this.places[partner];
    if (!from) return marks;
    const [x1, y1] = [to.x(from.x), to.y(from.y)];
    if (match) {
      const [x2, y2] = [to.x(match.x), to.y(match.y)];
      marks.push(svg("line", { class: "link", x1, y1, x2, y2 }));
      marks.push(svg("circle", { class: "partner", cx: x2, cy: y2, r: 6 }));
    }
    marks.push(svg("circle", { class: "selected", cx: x1, cy: y1, r: 9, "data-frame": frame }));
    return marks;
  }
}
