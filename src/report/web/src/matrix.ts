// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { viridis } from "./colour_map.ts";
import { html, svg } from "./dom.ts";
import * as format from "./format.ts";
import { frameText } from "./frame_text.ts";
import { Path, type Pen } from "./pen.ts";
import { Plot } from "./plot.ts";
import type { Hit } from "./plot_spec.ts";
import { nearest, type Projection } from "./projection.ts";
import type { SimilarityMatrix } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import { decodeMatrix, type SimilarityImage } from "./similarity_image.ts";
import type { Selection, Store } from "./store.ts";
import type { Theme } from "./theme.ts";
import { drawTruth, type TruthOverlay, truthOverlay } from "./truth_overlay.ts";
import { drawMarks, kMarked, markRadius, type Point } from "./verdicts.ts";
import { caption, section, type View } from "./view.ts";

const kMaxSide = 640;

/** xi of every frame with every earlier frame, with truth and loops drawn on top. */
export class Matrix implements View {
  readonly element: HTMLElement;
  private readonly caption = caption();
  private readonly key = html("div", { class: "matrix-key" });
  private readonly plot: Plot;
  private image: SimilarityImage | null = null;
  private truth: TruthOverlay | null = null;
  private framesPerCell = 1;

  constructor(private readonly store: Store) {
    this.plot = new Plot({
      label: "Similarity matrix. Rows are queries, columns are earlier frames.",
      xLabel: "earlier frame",
      yLabel: "query",
      height: (width) => width - 8,
      zoom: "xy",
      whole: "xy",
      yDown: true,
      bounds: () => {
        const frames = Math.max(1, this.store.model.frames);
        return { x: [0, frames], y: [0, frames] };
      },
      draw: (ctx, to, theme) => this.draw(ctx, to, theme),
      hit: (pixel, to) => this.hitAt(pixel, to),
      selected: (to) => this.selected(to),
      place: () => this.place(),
      select: (hit) => this.store.select(hit.frame, hit.against ?? "match"),
    });
    this.element = section(
      "matrix",
      "Similarity matrix",
      this.caption,
      this.plot.controls(),
      html("div", { class: "square" }, this.plot.element, this.key),
    );
  }

  showRun(model: RunModel): void {
    const { similarity_matrix: matrix, truth } = model.run;
    this.showImage(null);
    this.framesPerCell = matrix?.frames_per_cell ?? Math.max(1, Math.ceil(model.frames / kMaxSide));
    const side = matrix?.side ?? Math.ceil(model.frames / this.framesPerCell);
    this.truth = truth ? truthOverlay(truth.same_place, side, this.framesPerCell) : null;
    this.describe(model);
    this.plot.reset();
    if (!matrix) return;
    void decodeMatrix(matrix).then((image) => {
      if (this.store.model !== model) return;
      this.showImage(image);
      this.showKey();
      this.plot.redraw();
    });
  }

  showSelection(_: Selection): void {
    this.plot.follow();
  }

  /** The cell of the selected frame and what is beside it, or the end of its row. */
  private place(): Point {
    const { frame } = this.store.now;
    const partner = this.store.model.partner(this.store.now);
    return { x: (partner ?? frame) + 0.5, y: frame + 0.5 };
  }

  private showImage(image: SimilarityImage | null): void {
    this.image = image;
    this.element.classList.toggle("no-picture", image === null);
  }

  private describe(model: RunModel): void {
    const hasPairs = (model.run.truth?.same_place.length ?? 0) > 0;
    const outlined = hasPairs ? "True pairs are outlined." : "There are no true pairs.";
    const truth = this.truth
      ? outlined
      : "There is no ground truth. --truth FILE outlines the true pairs.";
    const matrix = model.run.similarity_matrix;
    const none = model.isLive
      ? "The similarities of all frames are shown when the run has ended."
      : "The run stored no binary contents to compare.";
    this.caption.textContent = matrix
      ? `${meaningOfCells(matrix)} ${truth} Click a cell to see its two frames.`
      : `Loops by query and match. ${none} ${truth}`;
    this.key.replaceChildren();
  }

  private showKey(): void {
    if (!this.image) return;
    const bar = html("canvas", { width: 128, height: 1, class: "colour-bar" });
    const ctx = bar.getContext("2d");
    for (let x = 0; ctx && x < 128; ++x) {
      ctx.fillStyle = `rgb(${viridis(x / 127).join(" ")})`;
      ctx.fillRect(x, 0, 1, 1);
    }
    const [low, high] = this.image.range;
    const ends = html(
      "div",
      { class: "ends" },
      html("span", {}, low.toFixed(2)),
      html("span", {}, html("span", { class: "word" }, "similarity "), "ξ"),
      html("span", {}, high.toFixed(2)),
    );
    this.key.replaceChildren(bar, ends);
  }

  private draw(ctx: Pen, to: Projection, theme: Theme): void {
    const { image, truth } = this;
    if (image) {
      const size = image.side * image.framesPerCell;
      const width = to.x(size) - to.x(0);
      ctx.imageSmoothingEnabled = width < image.side;
      ctx.drawImage(image.picture, to.x(0), to.y(0), width, to.y(size) - to.y(0));
    } else {
      this.drawDiagonal(ctx, to, theme);
    }
    if (truth) drawTruth(ctx, to, truth, this.framesPerCell, image !== null, theme.muted);
    const model = this.store.model;
    const radius = Math.max(2.5, markRadius(model.framesIn("loops").length) - 1) * to.ratio;
    for (const verdict of kMarked) {
      const points = model.loopsMarked(verdict).map((frame) => ({
        x: to.x((model.match(frame) ?? 0) + 0.5),
        y: to.y(frame + 0.5),
      }));
      drawMarks(ctx, verdict, points, radius, theme);
    }
  }

  private drawDiagonal(ctx: Pen, to: Projection, theme: Theme): void {
    const { frames } = this.store.model;
    ctx.strokeStyle = theme.faint;
    ctx.lineWidth = to.ratio;
    const line = new Path();
    line.moveTo(to.x(0), to.y(0));
    line.lineTo(to.x(frames), to.y(frames));
    ctx.stroke(line);
  }

  /** The nearest loop mark, otherwise the pair under the pointer. */
  private hitAt(pixel: Point, to: Projection): Hit | null {
    const model = this.store.model;
    const loops = model.framesIn("loops").filter((frame) => model.isLoopHere(frame));
    const place = (frame: number) => ({ x: (model.match(frame) ?? 0) + 0.5, y: frame + 0.5 });
    const reach = model.frames * Math.abs(to.x(1) - to.x(0)) > 4 * to.width ? 12 : 7;
    const near = nearest(
      to,
      pixel,
      loops.length,
      (i) => place(loops[i] ?? 0),
      () => 0,
      reach,
    );
    const loop = near === null ? undefined : loops[near];
    if (loop !== undefined) {
      return { frame: loop, at: place(loop), cross: true, text: frameText(model, loop) };
    }
    const frame = Math.floor(to.atY(pixel.y));
    const earlier = Math.floor(to.atX(pixel.x));
    if (earlier < 0 || frame <= earlier || frame >= model.frames) return null;
    const text = [`query ${frame}`, `earlier frame ${earlier}`];
    text.push(...this.cellText(frame, earlier));
    return { frame, against: earlier, at: { x: earlier + 0.5, y: frame + 0.5 }, cross: true, text };
  }

  /** The text of a cell, and the frames that it covers. */
  private cellText(frame: number, earlier: number): string[] {
    if (!this.image) return [];
    const { side, framesPerCell, levels } = this.image;
    const [row, column] = [Math.floor(frame / framesPerCell), Math.floor(earlier / framesPerCell)];
    const similarity = format.similarity((levels[row * side + column] ?? 0) / 255);
    if (framesPerCell === 1) return [`ξ ${similarity}`];
    const span = (cell: number) => {
      const last = Math.min(this.store.model.frames, (cell + 1) * framesPerCell) - 1;
      return `${cell * framesPerCell}–${last}`;
    };
    const step = this.store.model.run.similarity_matrix?.compared_every ?? 1;
    const what = step > 1 ? "largest ξ compared" : "largest ξ";
    return [`${what} of frames ${span(row)} × ${span(column)}: ${similarity}`];
  }

  private selected(to: Projection): SVGElement[] {
    const { frame } = this.store.now;
    const place = this.place();
    const y = to.y(place.y);
    const marks: SVGElement[] = [
      svg("line", { class: "hair", x1: 0, x2: to.x(frame + 0.5), y1: y, y2: y }),
    ];
    if (this.store.model.partner(this.store.now) !== null) {
      const x = to.x(place.x);
      marks.push(svg("line", { class: "hair", x1: x, x2: x, y1: y, y2: to.height }));
      marks.push(svg("circle", { class: "selected", cx: x, cy: y, r: 8, "data-frame": frame }));
    }
    return marks;
  }
}

/** What a cell shows, and how it is computed if it covers several frames. */
function meaningOfCells(matrix: SimilarityMatrix): string {
  const { frames_per_cell: wide, compared_every: step } = matrix;
  if (wide === 1) return "The similarity ξ of each query with every earlier frame.";
  const cell = `A cell shows the largest ξ of ${wide} × ${wide} frames`;
  if (step === 1) {
    return `The similarity ξ of each query with every earlier frame. ${cell}.`;
  }
  return `The similarity ξ of one frame in ${step} with one earlier frame in ${step}, and of every frame with its own match. ${cell}, among those that were compared.`;
}
