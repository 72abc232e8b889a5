// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html } from "./dom.ts";

/** Pixels of a PNG per pixel on the page. */
const kPngScale = 3;

/** A drawing for a file. */
export interface Figure {
  svg: string;
  width: number;
  height: number;
}

/** Hands a file to the browser's downloads. */
export function save(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  html("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

export const saveText = (name: string, text: string): void =>
  save(name, new Blob([text], { type: "text/plain" }));

/** A whole SVG file; `content` in pixels. */
export function figureOf(width: number, height: number, content: string, font: string): Figure {
  const family = font.replaceAll('"', "'");
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="${family}">\n${content}\n</svg>\n`;
  return { svg, width, height };
}

async function savePng(name: string, { svg, width, height }: Figure): Promise<void> {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = html("canvas", { width: kPngScale * width, height: kPngScale * height });
  canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
  canvas.toBlob((blob) => blob && save(name, blob));
}

/** Buttons that save a figure; `draw` returns null while there is nothing to see. */
export function saveButtons(what: string, draw: () => Figure | null): HTMLElement {
  const name = what.toLowerCase().replaceAll(/\W+/g, "_");
  const add = (kind: "SVG" | "PNG", act: (figure: Figure) => void) =>
    button(
      { "aria-label": `Save as ${kind}: ${what}`, title: `Save as ${kind}` },
      () => {
        const figure = draw();
        if (figure) act(figure);
      },
      kind,
    );
  return html(
    "span",
    { class: "save" },
    add("SVG", ({ svg }) => save(`${name}.svg`, new Blob([svg], { type: "image/svg+xml" }))),
    add("PNG", (figure) => void savePng(`${name}.png`, figure)),
  );
}
