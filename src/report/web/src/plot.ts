// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { type Bounds, middle, panned, withEqualAxes, type ZoomAxes, zoomed } from "./bounds.ts";
import { button, html, svg } from "./dom.ts";
import { Projection } from "./projection.ts";
import type { Against } from "./store.ts";
import { onThemeChange, type Theme, theme } from "./theme.ts";
import { hideTip, showTip } from "./tip.ts";

/** What is under the pointer. */
export interface Hit {
  frame: number;
  against?: Against;
  /** Where it is drawn; hairlines instead of a ring where `cross` is set. */
  at: { x: number; y: number };
  cross?: boolean;
  text: readonly string[];
}

export interface PlotSpec {
  /** For those who do not see it. */
  label: string;
  xLabel: string;
  yLabel: string;
  height: (width: number) => number;
  zoom: ZoomAxes;
  equalAxes?: boolean;
  yDown?: boolean;
  hideAxes?: boolean;
  /** All there is to see. */
  bounds(): Bounds;
  draw(ctx: CanvasRenderingContext2D, to: Projection, theme: Theme): void;
  /** `pixel` and `to` in CSS pixels of the plotting area. */
  hit(pixel: { x: number; y: number }, to: Projection): Hit | null;
  /** Marks what is selected, in CSS pixels of the plotting area. */
  selected(to: Projection): SVGElement[];
  select(hit: Hit): void;
}

const kAxisFont_px = 12;
const kDragBegins_px = 4;
const kZoomStep = 1.6;
const plots: Plot[] = [];

/** Before and after printing the page has another width, and no observer tells in time. */
export function resizePlots(): void {
  for (const plot of plots) plot.resize();
}

/** uPlot for axes, scales and canvas; what is on it is drawn by the view. */
export class Plot {
  readonly element: HTMLElement;
  private readonly overlay = svg("svg", { class: "overlay", "aria-hidden": "true" });
  private plot: uPlot | null = null;
  private home: Bounds = { x: [0, 1], y: [0, 1] };
  private view: Bounds = this.home;
  private hovered: Hit | null = null;

  constructor(private readonly spec: PlotSpec) {
    const keys = spec.zoom === "none" ? "" : " Keys + and - zoom, 0 shows all.";
    this.element = html("div", {
      class: `plot${spec.zoom === "none" ? "" : " zoomable"}`,
      role: "group",
      tabindex: spec.zoom === "none" ? null : 0,
      "aria-label": spec.label + keys,
    });
    this.element.addEventListener("keydown", (event) => this.onKey(event));
    new ResizeObserver(() => this.resize()).observe(this.element);
    onThemeChange(() => this.plot?.redraw(false, true));
    plots.push(this);
  }

  /** Buttons for those who neither wheel nor drag. */
  controls(): HTMLElement {
    const name = this.spec.label.split(".")[0] ?? "";
    return html(
      "span",
      { class: "zoom" },
      button(
        { "aria-label": `Zoom in: ${name}`, title: "Zoom in" },
        () => this.zoom(kZoomStep),
        "+",
      ),
      button(
        { "aria-label": `Zoom out: ${name}`, title: "Zoom out" },
        () => this.zoom(1 / kZoomStep),
        "−",
      ),
      button({ "aria-label": `Show all: ${name}`, title: "Show all" }, () => this.reset(), "reset"),
    );
  }

  /** Other data: everything is shown again. */
  reset(): void {
    this.home = this.spec.bounds();
    const plot = this.plot;
    if (plot && this.spec.equalAxes) {
      const { width, height } = this.area(plot);
      this.home = withEqualAxes(this.home, width, height);
    }
    this.show(this.home);
  }

  redraw(): void {
    this.plot?.redraw(false, false);
  }

  /** Only what marks the selection. */
  mark(): void {
    if (!this.plot) return;
    const to = this.projection(this.plot);
    this.overlay.replaceChildren(...this.spec.selected(to), ...this.hoverMarks(to));
  }

  resize(): void {
    const width = Math.floor(this.element.clientWidth);
    if (width < 40) return;
    const size = { width, height: Math.round(this.spec.height(width)) };
    if (!this.plot) {
      this.plot = this.make(size);
      this.reset();
    } else if (size.width !== this.plot.width || size.height !== this.plot.height) {
      this.plot.setSize(size);
      this.reset();
    }
  }

  private make(size: { width: number; height: number }): uPlot {
    const colour = (name: "muted" | "rule") => () => theme()[name];
    const axis = (label: string): uPlot.Axis => ({
      label,
      show: this.spec.hideAxes !== true,
      stroke: colour("muted"),
      font: `${kAxisFont_px}px ${theme().font}`,
      labelFont: `${kAxisFont_px}px ${theme().font}`,
      labelSize: 20,
      labelGap: 0,
      gap: 4,
      grid: { stroke: colour("rule"), width: 1 },
      ticks: { stroke: colour("rule"), width: 1, size: 4 },
    });
    const range = (axis: "x" | "y") => (): uPlot.Range.MinMax => [...this.view[axis]];
    const plot = new uPlot(
      {
        ...size,
        padding: [10, 10, 2, 2],
        legend: { show: false },
        cursor: { show: false },
        scales: {
          x: { time: false, range: range("x") },
          y: { range: range("y"), dir: this.spec.yDown ? -1 : 1 },
        },
        axes: [
          { ...axis(this.spec.xLabel), size: 28, space: 60 },
          { ...axis(this.spec.yLabel), size: 46, space: 36 },
        ],
        series: [{}, { paths: () => null, points: { show: false } }],
        hooks: { draw: [(drawn) => this.draw(drawn)] },
      },
      [
        [0, 1],
        [0, 1],
      ],
      this.element,
    );
    plot.over.append(this.overlay);
    this.listen(plot.over);
    return plot;
  }

  private listen(over: HTMLElement): void {
    over.addEventListener("pointermove", (event) => this.hover(event));
    over.addEventListener("pointerleave", () => this.unhover());
    over.addEventListener("pointerdown", (event) => this.drag(over, event));
    // The wheel scrolls the page unless the plot was clicked or Ctrl is held.
    over.addEventListener("wheel", (event) => {
      const isMeant = event.ctrlKey || document.activeElement === this.element;
      if (this.spec.zoom === "none" || !isMeant) return;
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 400), this.pixel(event));
    });
  }

  private onKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || this.spec.zoom === "none") return;
    if (event.key === "+" || event.key === "=") this.zoom(kZoomStep);
    else if (event.key === "-") this.zoom(1 / kZoomStep);
    else if (event.key === "0") this.reset();
  }

  private drag(over: HTMLElement, down: PointerEvent): void {
    if (down.button !== 0) return;
    const start = this.view;
    let isDrag = false;
    const move = (event: PointerEvent) => {
      const dx = event.clientX - down.clientX;
      const dy = event.clientY - down.clientY;
      isDrag ||= Math.hypot(dx, dy) >= kDragBegins_px;
      if (!isDrag || !this.plot) return;
      const { width, height } = this.area(this.plot);
      const xUnits = ((start.x[1] - start.x[0]) / width) * -dx;
      const yUnits = ((start.y[1] - start.y[0]) / height) * (this.spec.yDown ? -dy : dy);
      this.show(panned(start, this.home, this.spec.zoom, xUnits, yUnits));
    };
    const end = (event: PointerEvent) => {
      over.removeEventListener("pointermove", move);
      over.removeEventListener("pointerup", end);
      over.removeEventListener("pointercancel", end);
      if (isDrag || event.type === "pointercancel") return;
      const hit = this.hitAt(event);
      if (hit) this.spec.select(hit);
    };
    over.setPointerCapture(down.pointerId);
    over.addEventListener("pointermove", move);
    over.addEventListener("pointerup", end);
    over.addEventListener("pointercancel", end);
  }

  private zoom(factor: number, pixel?: { x: number; y: number }): void {
    if (!this.plot) return;
    const to = this.projection(this.plot);
    const about = pixel ? { x: to.atX(pixel.x), y: to.atY(pixel.y) } : middle(this.view);
    this.show(zoomed(this.view, this.home, this.spec.zoom, factor, about));
  }

  private show(view: Bounds): void {
    this.view = view;
    const plot = this.plot;
    plot?.batch(() => {
      plot.setScale("x", { min: view.x[0], max: view.x[1] });
      plot.setScale("y", { min: view.y[0], max: view.y[1] });
      plot.redraw(false, true);
    });
  }

  private draw(plot: uPlot): void {
    const { left, top, width, height } = plot.bbox;
    const ratio = uPlot.pxRatio;
    const yDown = this.spec.yDown === true;
    const to = new Projection(this.view, left, top, width, height, yDown, ratio);
    const { ctx } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    this.spec.draw(ctx, to, theme());
    ctx.restore();
    this.mark();
  }

  private area(plot: uPlot): { width: number; height: number } {
    const ratio = uPlot.pxRatio;
    return { width: plot.bbox.width / ratio, height: plot.bbox.height / ratio };
  }

  private projection(plot: uPlot): Projection {
    const { width, height } = this.area(plot);
    return new Projection(this.view, 0, 0, width, height, this.spec.yDown === true, 1);
  }

  private pixel(event: MouseEvent): { x: number; y: number } {
    const box = this.plot?.over.getBoundingClientRect();
    return { x: event.clientX - (box?.left ?? 0), y: event.clientY - (box?.top ?? 0) };
  }

  private hitAt(event: MouseEvent): Hit | null {
    return this.plot ? this.spec.hit(this.pixel(event), this.projection(this.plot)) : null;
  }

  private hover(event: PointerEvent): void {
    this.hovered = event.buttons === 0 ? this.hitAt(event) : null;
    if (this.hovered) showTip(this.hovered.text, event.clientX, event.clientY);
    else hideTip();
    this.mark();
  }

  private unhover(): void {
    this.hovered = null;
    hideTip();
    this.mark();
  }

  private hoverMarks(to: Projection): SVGElement[] {
    if (!this.hovered) return [];
    const x = to.x(this.hovered.at.x);
    const y = to.y(this.hovered.at.y);
    if (!this.hovered.cross) return [svg("circle", { class: "hovered", cx: x, cy: y, r: 7 })];
    return [
      svg("line", { class: "hovered", x1: 0, x2: to.width, y1: y, y2: y }),
      svg("line", { class: "hovered", x1: x, x2: x, y1: 0, y2: to.height }),
    ];
  }
}
