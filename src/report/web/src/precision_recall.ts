// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { html, svg } from "./dom.ts";
import { curveOf, figuresOf } from "./figures.ts";
import * as format from "./format.ts";
import { Path, type Pen } from "./pen.ts";
import { Plot } from "./plot.ts";
import type { Hit } from "./plot_spec.ts";
import { nearest, type Projection } from "./projection.ts";
import type { CurvePoint } from "./report_data.ts";
import { dashOf, lineOf } from "./run_lines.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import type { Theme } from "./theme.ts";
import type { Point } from "./verdicts.ts";
import { caption, section, type View } from "./view.ts";

const kCaption =
  "Each point shows recall and precision if every frame with at least that score were a loop. The large dot is the detector's own decision. The bar is the highest recall without a wrong loop.";

const at = ({ recall, precision }: { recall: number; precision: number }): Point => ({
  x: recall,
  y: precision,
});

/** Precision against recall over all thresholds, all runs in one plot. */
export class PrecisionRecall implements View {
  readonly element: HTMLElement;
  private readonly caption = caption();
  private readonly key = html("ul", { class: "legend" });
  private readonly plot: Plot;
  private readonly controls: HTMLElement;

  constructor(
    private readonly store: Store,
    private readonly models: readonly RunModel[],
  ) {
    this.plot = new Plot({
      label: "Precision and recall. One curve per run.",
      xLabel: "recall",
      yLabel: "precision",
      height: (width) => Math.max(260, Math.min(width * 0.66, 420)),
      zoom: "xy",
      bounds: () => ({ x: [-0.02, 1.03], y: [-0.02, 1.05] }),
      draw: (ctx, to, theme) => this.draw(ctx, to, theme),
      hit: (pixel, to) => this.hitAt(pixel, to),
      selected: (to) => this.selected(to),
      place: () => this.place(),
      select: (hit) => this.store.select(hit.frame),
    });
    this.controls = this.plot.controls();
    this.element = section(
      "precision-recall",
      "Precision and recall",
      this.caption,
      this.controls,
      this.key,
      this.plot.element,
    );
  }

  showRun(model: RunModel): void {
    this.caption.textContent = captionOf(model);
    const { evaluation } = model.run;
    const entries: HTMLElement[] = [];
    this.models.forEach((other, i) => {
      if (!other.run.evaluation || this.models.length < 2) return;
      entries.push(html("li", {}, lineOf(i, other === model), other.run.name));
    });
    if (evaluation && curveOf(evaluation).length > 0) {
      const { recall, precision, recallAtFullPrecision: full } = figuresOf(evaluation);
      entries.push(
        html(
          "li",
          {},
          `as decided: recall ${format.share(recall)}, precision ${format.share(precision)}`,
        ),
        html("li", {}, `recall at 100 % precision: ${format.share(full)}`),
      );
    }
    this.key.replaceChildren(...entries);
    const isBlank = this.models.every((other) => curveOf(other.run.evaluation).length === 0);
    this.plot.element.hidden = isBlank;
    this.controls.hidden = isBlank;
    this.plot.reset();
  }

  showSelection(_: Selection): void {
    this.plot.follow();
  }

  private draw(ctx: Pen, to: Projection, theme: Theme): void {
    this.models.forEach((model, i) => {
      if (model !== this.store.model) this.drawCurve(ctx, to, theme, model, i, false);
    });
    const { run } = this.store.now;
    this.drawCurve(ctx, to, theme, this.store.model, run, true);
  }

  private drawCurve(
    ctx: Pen,
    to: Projection,
    theme: Theme,
    model: RunModel,
    index: number,
    isSelected: boolean,
  ): void {
    const { evaluation } = model.run;
    if (!evaluation) return;
    const path = new Path();
    curveOf(evaluation).forEach((point, i) => {
      if (i === 0) path.moveTo(to.x(0), to.y(point.precision));
      path.lineTo(to.x(point.recall), to.y(point.precision));
    });
    const colour = isSelected ? theme.ink : theme.muted;
    ctx.strokeStyle = colour;
    ctx.lineWidth = (isSelected ? 2 : 1.5) * to.ratio;
    ctx.setLineDash(dashOf(index).map((length) => length * to.ratio));
    ctx.stroke(path);
    ctx.setLineDash([]);
    const { recall, precision, recallAtFullPrecision: full } = figuresOf(evaluation);
    if (full !== null) {
      const bar = 7 * to.ratio;
      const limit = new Path();
      limit.moveTo(to.x(full), to.y(1) - bar);
      limit.lineTo(to.x(full), to.y(1) + bar);
      ctx.stroke(limit);
    }
    if (recall === null || precision === null) return;
    const dot = new Path();
    dot.circle(to.x(recall), to.y(precision), (isSelected ? 5.5 : 4) * to.ratio);
    ctx.fillStyle = isSelected ? theme.right : theme.muted;
    ctx.fill(dot);
    ctx.lineWidth = 1.5 * to.ratio;
    ctx.strokeStyle = theme.paper;
    ctx.stroke(dot);
  }

  /** The frame whose score makes the point of the curve. */
  private hitAt(pixel: Point, to: Projection): Hit | null {
    const model = this.store.model;
    const curve = curveOf(model.run.evaluation);
    const i = nearest(
      to,
      pixel,
      curve.length,
      (k) => atIndex(curve, k),
      () => 0,
      30,
    );
    const point = i === null ? undefined : curve[i];
    if (!point) return null;
    const frame = model.run.score.indexOf(point.score);
    if (frame < 0) return null;
    const text = [
      `from score ${format.score(point.score)}`,
      `${point.right} right, ${point.wrong} wrong`,
      `recall ${format.share(point.recall)}, precision ${format.share(point.precision)}`,
    ];
    return { frame, at: at(point), text };
  }

  /** The point of the curve at the score of the selected frame. */
  private place(): Point | null {
    const { store } = this;
    const score = store.model.score(store.now.frame);
    const point = curveOf(store.model.run.evaluation).find((other) => other.score === score);
    return point ? at(point) : null;
  }

  private selected(to: Projection): SVGElement[] {
    const { frame } = this.store.now;
    const place = this.place();
    if (!place) return [];
    const ring = { cx: to.x(place.x), cy: to.y(place.y), r: 9 };
    return [svg("circle", { class: "selected", ...ring, "data-frame": frame })];
  }
}

function captionOf({ run }: RunModel): string {
  if (!run.evaluation) return "There is no ground truth for this run.";
  if (run.evaluation.positives === 0) {
    return "There is no curve because no revisit is scored.";
  }
  return curveOf(run.evaluation).length > 0
    ? kCaption
    : "There is no curve because no candidate is right or wrong.";
}

function atIndex(curve: readonly CurvePoint[], i: number): Point | null {
  const point = curve[i];
  return point ? at(point) : null;
}
