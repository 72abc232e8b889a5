// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { type Bounds, middle, panned, shows, withEqualAxes, zoomed } from "./bounds.ts";
import { button, html, svg } from "./dom.ts";
import { SvgPen } from "./pen.ts";
import { axesOf, drawAxes, type Ticks } from "./plot_axes.ts";
import { kZoomStep, listenToPlot, type PlotInput } from "./plot_input.ts";
import type { Hit, PlotSpec } from "./plot_spec.ts";
import { Projection } from "./projection.ts";
import { type Figure, figureOf, saveButtons } from "./save.ts";
import { onThemeChange, theme } from "./theme.ts";

const plots: Plot[] = [];

/** Printing changes the width of the page, and observers report that too late. */
export function resizePlots(): void {
  for (const plot of plots) plot.resize();
}

let isGrowing = false;

/** Shows data that have grown: a plot that someone zoomed keeps what it shows. */
export function showGrowth(show: () => void): void {
  isGrowing = true;
  try {
    show();
  } finally {
    isGrowing = false;
  }
}

/** Draws the plots one by one, each after the previous one is on the screen. */
export async function startPlots(): Promise<void> {
  for (const plot of plots) {
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    plot.start();
  }
}

/** uPlot provides axes, scales and canvas; the view draws the content. */
export class Plot implements PlotInput {
  readonly element: HTMLElement;
  private readonly overlay = svg("svg", { class: "overlay", "aria-hidden": "true" });
  private plot: uPlot | null = null;
  private home: Bounds = { x: [0, 1], y: [0, 1] };
  private view: Bounds = this.home;
  private hovered: Hit | null = null;
  private ticks: Record<"x" | "y", Ticks> = { x: [], y: [] };

  constructor(private readonly spec: PlotSpec) {
    const keys = spec.zoom === "none" ? "" : " Keys + and - zoom about the frame, 0 shows all.";
    this.element = html("div", {
      class: `plot${spec.zoom === "none" ? "" : " zoomable"}`,
      role: "group",
      tabindex: spec.zoom === "none" ? null : 0,
      "aria-label": spec.label + keys,
    });
    onThemeChange(() => this.plot?.redraw(false, true));
    plots.push(this);
  }

  /** Draws the plot from now on, at the available width. */
  start(): void {
    this.resize();
    new ResizeObserver(() => this.resize()).observe(this.element);
  }

  private get name(): string {
    return this.spec.label.split(".")[0] ?? "";
  }

  saveButtons(): HTMLElement {
    return saveButtons(this.name, () => this.figure());
  }

  /** Buttons to save the figure and to zoom, for users without wheel or drag. */
  controls(): HTMLElement {
    const { name } = this;
    const zoom = html(
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
    return html("span", { class: "plot-tools" }, this.saveButtons(), zoom);
  }

  /** What is in view, without the selection. */
  private figure(): Figure | null {
    const { plot } = this;
    if (!plot) return null;
    const { width, height } = this.area(plot);
    const [left, top] = [plot.bbox.left / uPlot.pxRatio, plot.bbox.top / uPlot.pxRatio];
    const yDown = this.spec.yDown === true;
    const to = new Projection(this.view, left, top, width, height, yDown, 1);
    const [frame, content] = [new SvgPen(), new SvgPen()];
    frame.fillStyle = theme().paper;
    frame.fillRect(0, 0, plot.width, plot.height);
    if (!this.spec.hideAxes?.()) drawAxes(frame, to, this.ticks, this.spec, theme());
    this.spec.draw(content, to, theme());
    const box = `x="${left}" y="${top}" width="${width}" height="${height}"`;
    const clipped = `<svg ${box} viewBox="${left} ${top} ${width} ${height}">\n${content.content}\n</svg>`;
    return figureOf(plot.width, plot.height, `${frame.content}\n${clipped}`, theme().font);
  }

  /** Shows everything again, after the data changed. */
  reset(): void {
    const { view } = this;
    const isZoomed = view !== this.home;
    this.goHome();
    if (isGrowing && isZoomed) this.show(view);
  }

  private goHome(): void {
    this.home = this.spec.bounds();
    this.show(this.home);
    const plot = this.plot;
    if (!plot || !this.spec.equalAxes) return;
    // Only now the labels have their room.
    const { width, height } = this.area(plot);
    this.home = withEqualAxes(this.home, width, height);
    this.show(this.home);
  }

  get isZoomable(): boolean {
    return this.spec.zoom !== "none";
  }

  get bounds(): Bounds {
    return this.view;
  }

  hover(hit: Hit | null): void {
    this.hovered = hit;
    this.mark();
  }

  select(hit: Hit): void {
    this.spec.select(hit);
  }

  redraw(): void {
    this.plot?.redraw(false, false);
  }

  /** Redraws only the selection. */
  mark(): void {
    if (!this.plot) return;
    const to = this.projection(this.plot);
    this.overlay.replaceChildren(...this.spec.selected(to), ...this.hoverMarks(to));
  }

  /** Marks a newly selected frame and moves the view to it. */
  follow(): void {
    const place = this.spec.place?.();
    if (!this.plot || !place || shows(this.view, this.spec.zoom, place)) {
      this.mark();
      return;
    }
    const { x, y } = middle(this.view);
    this.show(panned(this.view, this.home, this.spec.zoom, place.x - x, place.y - y));
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
    const range = (axis: "x" | "y") => (): uPlot.Range.MinMax => [...this.view[axis]];
    const { axes, overhang, ticks } = axesOf(this.spec);
    this.ticks = ticks;
    const plot = new uPlot(
      {
        ...size,
        padding: [10, overhang, 2, 2],
        legend: { show: false },
        cursor: { show: false },
        scales: {
          x: { time: false, range: range("x") },
          y: { range: range("y"), dir: this.spec.yDown ? -1 : 1 },
        },
        axes,
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
    listenToPlot(this, plot.over);
    return plot;
  }

  zoom(factor: number, event?: MouseEvent): void {
    if (!this.plot) return;
    const about = event ? this.placeAt(event, this.plot) : this.centre();
    this.show(zoomed(this.view, this.home, this.spec.zoom, factor, about));
  }

  private placeAt(event: MouseEvent, plot: uPlot): { x: number; y: number } {
    const pixel = this.pixel(event);
    const to = this.projection(plot);
    return { x: to.atX(pixel.x), y: to.atY(pixel.y) };
  }

  /** The selection, if it is in view. */
  private centre(): { x: number; y: number } {
    const place = this.spec.place?.();
    return place && shows(this.view, this.spec.zoom, place) ? place : middle(this.view);
  }

  pan(from: Bounds, dx: number, dy: number): void {
    if (!this.plot) return;
    const { width, height } = this.area(this.plot);
    const xUnits = ((from.x[1] - from.x[0]) / width) * -dx;
    const yUnits = ((from.y[1] - from.y[0]) / height) * (this.spec.yDown ? -dy : dy);
    this.show(panned(from, this.home, this.spec.zoom, xUnits, yUnits));
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

  hitAt(event: MouseEvent): Hit | null {
    return this.plot ? this.spec.hit(this.pixel(event), this.projection(this.plot)) : null;
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
