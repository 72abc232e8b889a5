// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Bounds } from "./bounds.ts";
import { html, svg } from "./dom.ts";
import * as format from "./format.ts";
import { Path, type Pen } from "./pen.ts";
import { Plot } from "./plot.ts";
import type { Hit } from "./plot_spec.ts";
import type { Projection } from "./projection.ts";
import { kSteps } from "./run_model.ts";
import type { Store } from "./store.ts";
import type { Theme } from "./theme.ts";
import { binsByFrame, binsByTime, type TimeBin } from "./time_bins.ts";
import type { Point } from "./verdicts.ts";

const kTimeBins = 36;
const kStretches = 120;

export type TimePlotKind = "distribution" | "along the run";

/** Stacked bars of the steps' times. */
export class TimePlot {
  readonly element: HTMLElement;
  private readonly plot: Plot;
  private bins: TimeBin[] = [];
  private shown: object | null = null;

  constructor(
    private readonly store: Store,
    private readonly kind: TimePlotKind,
  ) {
    const isDistribution = kind === "distribution";
    this.plot = new Plot({
      label: `Times, ${kind}. Stacked bars of the steps.`,
      xLabel: isDistribution ? "ms per frame" : "frame",
      yLabel: isDistribution ? "frames" : "ms per frame",
      height: () => 230,
      zoom: "none",
      whole: isDistribution ? "y" : "x",
      bounds: () => this.bounds(),
      draw: (ctx, to, theme) => this.draw(ctx, to, theme),
      hit: (pixel, to) => this.hitAt(pixel, to),
      selected: (to) => this.selected(to),
      select: (hit) => this.store.select(hit.frame),
    });
    this.element = html("div", {}, this.plot.element, this.plot.saveButtons());
  }

  refresh(): void {
    this.plot.reset();
  }

  mark(): void {
    this.plot.mark();
  }

  private get isDistribution(): boolean {
    return this.kind === "distribution";
  }

  private heightOf(bin: TimeBin): number {
    return this.isDistribution ? bin.frames.length : bin.total_ms;
  }

  private bounds(): Bounds {
    const model = this.store.model;
    if (this.shown !== model.totals_ms) {
      this.shown = model.totals_ms;
      this.bins = this.isDistribution
        ? binsByTime(model, Math.max(1, Math.min(kTimeBins, model.frames)))
        : binsByFrame(model, kStretches);
    }
    const top = this.bins.reduce((most, bin) => Math.max(most, this.heightOf(bin)), 0);
    return {
      x: [0, this.bins.at(-1)?.to ?? 1],
      y: [0, (top || 1) * (this.isDistribution ? 1.3 : 1.08)],
    };
  }

  private draw(ctx: Pen, to: Projection, theme: Theme): void {
    for (const bin of this.bins) {
      const left = to.x(bin.from);
      const gap = to.x(bin.to) - left > 4 * to.ratio ? to.ratio : 0;
      let below = 0;
      for (const step of kSteps) {
        const part = bin.total_ms > 0 ? bin.mean_ms[step] / bin.total_ms : 0;
        const above = below + part * this.heightOf(bin);
        ctx.fillStyle = theme[`step-${step}`];
        ctx.fillRect(left, to.y(above), to.x(bin.to) - left - gap, to.y(below) - to.y(above));
        below = above;
      }
    }
    if (this.isDistribution) this.drawFigures(ctx, to, theme);
  }

  private drawFigures(ctx: Pen, to: Projection, theme: Theme): void {
    const summary = this.store.model.totalTime();
    if (!summary) return;
    ctx.font = `${12 * to.ratio}px ${theme.font}`;
    for (const [i, figure] of (["mean", "p99"] as const).entries()) {
      const x = to.x(summary[figure]);
      ctx.setLineDash([4 * to.ratio, 3 * to.ratio]);
      ctx.strokeStyle = theme.ink;
      ctx.lineWidth = 1.2 * to.ratio;
      const line = new Path();
      line.moveTo(x, to.top);
      line.lineTo(x, to.top + to.height);
      ctx.stroke(line);
      ctx.setLineDash([]);
      const isRight = x > to.left + 0.6 * to.width;
      ctx.textAlign = isRight ? "right" : "left";
      ctx.fillStyle = theme.ink;
      ctx.strokeStyle = theme.paper;
      ctx.lineWidth = 4 * to.ratio;
      const text = `${figure} ${format.milliseconds(summary[figure])}`;
      const place: [number, number] = [
        x + (isRight ? -5 : 5) * to.ratio,
        to.top + (12 + 16 * i) * to.ratio,
      ];
      ctx.strokeText(text, ...place);
      ctx.fillText(text, ...place);
    }
  }

  private binAt(pixel: Point, to: Projection): TimeBin | undefined {
    const x = to.atX(pixel.x);
    return this.bins.find((bin) => x >= bin.from && x < bin.to);
  }

  /** The slowest frame of the bar. */
  private hitAt(pixel: Point, to: Projection): Hit | null {
    const bin = this.binAt(pixel, to);
    const totals = this.store.model.totals_ms;
    if (!bin || !totals || bin.frames.length === 0) return null;
    const frame = bin.frames.reduce((a, b) => ((totals[b] ?? 0) > (totals[a] ?? 0) ? b : a));
    const steps = kSteps.map((step) => `${step} ${format.milliseconds(bin.mean_ms[step])}`);
    const head = this.isDistribution
      ? `${format.counted(bin.frames.length, "frame")} with about ${format.milliseconds(bin.total_ms)} ms`
      : `frames ${bin.from} to ${bin.to - 1}: ${format.milliseconds(bin.total_ms)} ms`;
    const text = [head, ...steps, `slowest: frame ${frame}`];
    return { frame, at: { x: (bin.from + bin.to) / 2, y: this.heightOf(bin) }, text };
  }

  private selected(to: Projection): SVGElement[] {
    const { frame } = this.store.now;
    const model = this.store.model;
    const last = this.bins.at(-1)?.to ?? 0;
    const total = Math.min(model.totals_ms?.[frame] ?? 0, last);
    if (!model.isReadable(frame)) return [];
    const x = to.x(this.isDistribution ? total : frame + 0.5);
    return [
      svg("line", { class: "hair", x1: x, x2: x, y1: 0, y2: to.height }),
      svg("path", { class: "pointer", d: `M${x},${to.height}l-5,8h10z`, "data-frame": frame }),
    ];
  }
}
