// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { type Content, contentOf, kSide, overlapOf } from "./content.ts";
import { html } from "./dom.ts";
import * as format from "./format.ts";
import { partnerName } from "./partner.ts";
import type { Picture } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection } from "./store.ts";
import { onThemeChange, type Theme, theme } from "./theme.ts";

type Paint = (pixel: number, theme: Theme) => string | null;

/** Saliency and binary content of both frames, their AND at the best shift, and xi. */
export class PairContents {
  readonly element = html("div", { class: "contents" });
  private repaint: (() => void)[] = [];

  constructor() {
    onThemeChange(() => {
      for (const paint of this.repaint) paint();
    });
  }

  show(model: RunModel, selection: Selection): void {
    this.repaint = [];
    const partner = model.partner(selection);
    const a = model.run.pictures[selection.frame];
    const b = partner === null ? undefined : model.run.pictures[partner];
    const contentA = a?.content ? contentOf(a.content) : null;
    const contentB = b?.content ? contentOf(b.content) : null;
    this.element.replaceChildren(
      this.maps(`query ${selection.frame}`, a, contentA, "A"),
      this.maps(partnerName(model, selection), b, contentB, "B"),
    );
    if (contentA && contentB) {
      this.element.append(this.and(contentA, contentB, model.shiftTolerance));
    }
  }

  private maps(
    whose: string,
    picture: Picture | undefined,
    content: Content | null,
    letter: string,
  ): HTMLElement {
    const saliency = picture?.saliency
      ? html("img", {
          class: "map",
          alt: `saliency of ${whose}`,
          src: `data:image/png;base64,${picture.saliency}`,
        })
      : null;
    const bits = content
      ? this.map(`binary content of ${whose}`, (i, { ink }) => (content[i] ? ink : null))
      : null;
    return html(
      "div",
      { class: "maps" },
      saliency && figure(saliency, "saliency"),
      bits && figure(bits, `content ${letter}`),
    );
  }

  private and(a: Content, b: Content, tolerance: number): HTMLElement {
    const overlap = overlapOf(a, b, tolerance);
    const { moved, shift } = overlap;
    const picture = this.map("both contents, overlaid", (i, colours) => {
      if (moved[i] && b[i]) return colours.ink;
      if (moved[i]) return colours["step-content"];
      return b[i] ? colours.missed : null;
    });
    const columns = `${shift > 0 ? "+" : shift < 0 ? "−" : ""}${Math.abs(shift)}`;
    return html(
      "div",
      { class: "and" },
      figure(picture, "A ∧ B"),
      html(
        "div",
        { class: "equation" },
        html(
          "p",
          {},
          "ξ = |A ∧ B| / max(|A|, |B|) = ",
          html("span", {}, `${overlap.both} / ${overlap.larger} = `),
          html("strong", { "data-key": "pair.xi" }, format.similarity(overlap.similarity)),
        ),
        html(
          "p",
          { class: "small" },
          `A shifted by ${columns} ${Math.abs(shift) === 1 ? "column" : "columns"}, the best of up to ±${tolerance}. `,
          html("span", { class: "dot both" }),
          "both ",
          html("span", { class: "dot only-a" }),
          "only A ",
          html("span", { class: "dot only-b" }),
          "only B",
        ),
      ),
    );
  }

  private map(label: string, paint: Paint): HTMLCanvasElement {
    const canvas = html("canvas", {
      class: "map",
      width: kSide,
      height: kSide,
      role: "img",
      "aria-label": label,
    });
    const draw = () => {
      const ctx = canvas.getContext("2d");
      if (!ctx) return;
      ctx.fillStyle = theme().paper;
      ctx.fillRect(0, 0, kSide, kSide);
      for (let i = 0; i < kSide * kSide; ++i) {
        const colour = paint(i, theme());
        if (!colour) continue;
        ctx.fillStyle = colour;
        ctx.fillRect(i % kSide, Math.floor(i / kSide), 1, 1);
      }
    };
    draw();
    this.repaint.push(draw);
    return canvas;
  }
}

function figure(picture: HTMLElement, name: string): HTMLElement {
  return html("figure", {}, picture, html("figcaption", {}, name));
}
