// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { Bounds } from "./bounds.ts";
import type { Hit } from "./plot_spec.ts";
import { hideTip, showTip } from "./tip.ts";

const kDragBegins_px = 4;
const kWheelSpeed = 1 / 400;
export const kZoomStep = 1.6;

/** The operations of pointer, wheel and keys on a plot. */
export interface PlotInput {
  readonly element: HTMLElement;
  readonly isZoomable: boolean;
  readonly bounds: Bounds;
  hitAt(event: MouseEvent): Hit | null;
  hover(hit: Hit | null): void;
  select(hit: Hit): void;
  zoom(factor: number, event?: MouseEvent): void;
  /** Shows `from`, moved by this many CSS pixels. */
  pan(from: Bounds, dx: number, dy: number): void;
  reset(): void;
}

/** `over` is the element over the plotting area. */
export function listenToPlot(plot: PlotInput, over: HTMLElement): void {
  over.addEventListener("pointermove", (event) => {
    const hit = event.buttons === 0 ? plot.hitAt(event) : null;
    if (hit) showTip(hit.text, event.clientX, event.clientY);
    else hideTip();
    plot.hover(hit);
  });
  over.addEventListener("pointerleave", () => {
    hideTip();
    plot.hover(null);
  });
  over.addEventListener("pointerdown", (event) => {
    if (event.button === 0) followPointer(plot, over, event);
  });
  // The wheel scrolls the page unless the plot was clicked or Ctrl is held.
  over.addEventListener("wheel", (event) => {
    const isMeant = event.ctrlKey || document.activeElement === plot.element;
    if (!plot.isZoomable || !isMeant) return;
    event.preventDefault();
    plot.zoom(Math.exp(-event.deltaY * kWheelSpeed), event);
  });
  plot.element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !plot.isZoomable) return;
    if (event.key === "+" || event.key === "=") plot.zoom(kZoomStep);
    else if (event.key === "-") plot.zoom(1 / kZoomStep);
    else if (event.key === "0") plot.reset();
  });
}

/** Handles press to release: a drag moves the plot, a click selects. */
function followPointer(plot: PlotInput, over: HTMLElement, down: PointerEvent): void {
  const from = plot.bounds;
  let isDrag = false;
  const move = (event: PointerEvent) => {
    const dx = event.clientX - down.clientX;
    const dy = event.clientY - down.clientY;
    isDrag ||= Math.hypot(dx, dy) >= kDragBegins_px;
    if (isDrag) plot.pan(from, dx, dy);
  };
  const end = (event: PointerEvent) => {
    over.removeEventListener("pointermove", move);
    over.removeEventListener("pointerup", end);
    over.removeEventListener("pointercancel", end);
    const hit = isDrag || event.type === "pointercancel" ? null : plot.hitAt(event);
    if (hit) plot.select(hit);
  };
  over.setPointerCapture(down.pointerId);
  over.addEventListener("pointermove", move);
  over.addEventListener("pointerup", end);
  over.addEventListener("pointercancel", end);
}
