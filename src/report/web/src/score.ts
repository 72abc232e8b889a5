// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Bounds } from "./bounds.ts";
import { svg } from "./dom.ts";
import * as format from "./format.ts";
import { frameText } from "./frame_text.ts";
import { Path, type Pen } from "./pen.ts";
import { Plot } from "./plot.ts";
import { nearest, type Projection } from "./projection.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import type { Theme } from "./theme.ts";
import { drawMarks, kMarked, markRadius, type Point } from "./verdicts.ts";
import { caption, section, type View } from "./view.ts";

/** The score of every frame, in order, with the threshold. */
export class Score implements View {
  readonly element: HTMLElement;
  private readonly caption = caption();
  private readonly plot: Plot;

  constructor(private readonly store: Store) {
    this.plot = new Plot({
      label: "Score over time. The score of each frame.",
      xLabel: "frame",
      yLabel: "score",
      height: (width) => Math.max(220, Math.min(width * 0.34, 300)),
      zoom: "x",
      whole: "x",
      bounds: () => this.bounds(),
      draw: (ctx, to, theme) => this.draw(ctx, to, theme),
      hit: (pixel, to) => {
        const frame = this.frameAt(pixel, to);
        const at = frame === null ? null : this.place(frame);
        return frame === null || !at
          ? null
          : { frame, at, text: frameText(this.store.model, frame) };
      },
      selected: (to) => this.selected(to),
      place: () => this.place(this.store.now.frame) ?? { x: this.store.now.frame, y: 0 },
      select: (hit) => this.store.select(hit.frame),
    });
    this.element = section(
      "score",
      "Score over time",
      this.caption,
      this.plot.controls(),
      this.plot.element,
    );
  }

  showRun(model: RunModel): void {
    const { threshold } = model.run;
    this.caption.textContent =
      threshold === null
        ? "The score of each frame's best candidate, as reported by the detector. Its threshold is unknown."
        : `The score of each frame's best candidate. It is accepted from ${format.score(threshold)} (dashed line).`;
    this.plot.reset();
  }

  showSelection(_: Selection): void {
    this.plot.follow();
  }

  private place(frame: number): Point | null {
    const score = this.store.model.score(frame);
    return score === null ? null : { x: frame, y: score };
  }

  private pixel(frame: number, to: Projection): Point | null {
    const place = this.place(frame);
    return place && { x: to.x(place.x), y: to.y(place.y) };
  }

  private bounds(): Bounds {
    const { run, frames } = this.store.model;
    const scores = run.score.filter((score) => score !== null).filter(Number.isFinite);
    const top = scores.reduce((a, b) => Math.max(a, b), 1.15 * (run.threshold ?? 0));
    const low = scores.reduce((a, b) => Math.min(a, b), 0);
    const air = (top - low || 1) * 0.07;
    const side = Math.max(0.5, frames * 0.012);
    return {
      x: [-side, Math.max(1, frames) - 1 + side],
      y: [low < 0 ? low - air : -0.4 * air, top + air],
    };
  }

  private draw(ctx: Pen, to: Projection, theme: Theme): void {
    const model = this.store.model;
    this.drawUnmarked(ctx, to, theme);
    const count = model.framesIn("loops").length + model.framesIn("missed").length;
    for (const verdict of kMarked) {
      const points = model.framesMarked(verdict).flatMap((frame) => this.pixel(frame, to) ?? []);
      drawMarks(ctx, verdict, points, (markRadius(count) - 0.5) * to.ratio, theme);
    }
    if (model.run.threshold !== null) this.drawThreshold(ctx, to, theme, model.run.threshold);
  }

  private drawUnmarked(ctx: Pen, to: Projection, theme: Theme): void {
    const model = this.store.model;
    const size = (model.frames > 2000 ? 2 : 3) * to.ratio;
    ctx.fillStyle = theme.faint;
    for (let frame = 0; frame < model.frames; ++frame) {
      const at = model.mark(frame) === null ? this.pixel(frame, to) : null;
      if (at) ctx.fillRect(at.x - size / 2, at.y - size / 2, size, size);
    }
  }

  private drawThreshold(ctx: Pen, to: Projection, theme: Theme, threshold: number): void {
    const y = to.y(threshold);
    ctx.strokeStyle = theme.ink;
    ctx.lineWidth = 1.2 * to.ratio;
    ctx.setLineDash([5 * to.ratio, 4 * to.ratio]);
    const line = new Path();
    line.moveTo(to.left, y);
    line.lineTo(to.left + to.width, y);
    ctx.stroke(line);
    ctx.setLineDash([]);
    ctx.font = `${12 * to.ratio}px ${theme.font}`;
    ctx.textAlign = "left";
    ctx.fillStyle = theme.ink;
    ctx.strokeStyle = theme.paper;
    ctx.lineWidth = 4 * to.ratio;
    const text = `threshold ${format.score(threshold)}`;
    const at: [number, number] = [to.left + 6 * to.ratio, y - 6 * to.ratio];
    ctx.strokeText(text, ...at);
    ctx.fillText(text, ...at);
  }

  /** The nearest mark, otherwise the frame in the column under the pointer. */
  private frameAt(pixel: Point, to: Projection): number | null {
    const model = this.store.model;
    const near = nearest(
      to,
      pixel,
      model.frames,
      (frame) => this.place(frame),
      (frame) => (model.mark(frame) !== null ? -4 : 0),
    );
    if (near !== null) return near;
    const frame = Math.round(to.atX(pixel.x));
    return frame >= 0 && frame < model.frames ? frame : null;
  }

  private selected(to: Projection): SVGElement[] {
    const { frame } = this.store.now;
    const x = to.x(frame);
    const at = this.pixel(frame, to);
    const marks: SVGElement[] = [
      svg("line", { class: "hair", x1: x, x2: x, y1: 0, y2: to.height }),
    ];
    if (at) {
      marks.push(
        svg("circle", { class: "selected", cx: at.x, cy: at.y, r: 8, "data-frame": frame }),
      );
    }
    return marks;
  }
}
