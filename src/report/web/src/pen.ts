// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

/** What the views draw with: a canvas, or a file. */
export type Pen = Pick<
  CanvasRenderingContext2D,
  | "strokeStyle"
  | "fillStyle"
  | "lineWidth"
  | "lineJoin"
  | "lineCap"
  | "globalAlpha"
  | "font"
  | "textAlign"
  | "imageSmoothingEnabled"
  | "setLineDash"
  | "stroke"
  | "fill"
  | "fillRect"
  | "fillText"
  | "strokeText"
  | "drawImage"
>;

const kDigits = 100;
const short = (value: number) => Math.round(value * kDigits) / kDigits;

interface Stamp {
  unit: string;
  radius: number;
  x: number;
  y: number;
}

/** A path for a canvas that SvgPen can read back. */
export class Path extends Path2D {
  readonly stamps: Stamp[] = [];
  private readonly steps: (string | number)[] = [];

  override moveTo(x: number, y: number): void {
    super.moveTo(x, y);
    this.steps.push("M", short(x), short(y));
  }

  override lineTo(x: number, y: number): void {
    super.lineTo(x, y);
    this.steps.push("L", short(x), short(y));
  }

  circle(x: number, y: number, radius: number): void {
    this.moveTo(x + radius, y);
    super.arc(x, y, radius, 0, 2 * Math.PI);
    const [r, across] = [short(radius), short(2 * radius)];
    this.steps.push(`a${r},${r} 0 1 0 -${across},0a${r},${r} 0 1 0 ${across},0`);
  }

  /** Adds the SVG path `unit`, enlarged and moved. */
  stamp(unit: string, radius: number, x: number, y: number): void {
    super.addPath(new Path2D(unit), { a: radius, d: radius, e: x, f: y });
    this.stamps.push({ unit, radius, x, y });
  }

  get d(): string {
    return this.steps.join(" ");
  }
}

/** Writes what is drawn as SVG elements. */
export class SvgPen implements Pen {
  strokeStyle: string | CanvasGradient | CanvasPattern = "#000";
  fillStyle: string | CanvasGradient | CanvasPattern = "#000";
  lineWidth = 1;
  lineJoin: CanvasLineJoin = "miter";
  lineCap: CanvasLineCap = "butt";
  globalAlpha = 1;
  font = "10px sans-serif";
  textAlign: CanvasTextAlign = "start";
  imageSmoothingEnabled = true;
  private dash: readonly number[] = [];
  private readonly elements: string[] = [];

  get content(): string {
    return this.elements.join("\n");
  }

  setLineDash(dash: Iterable<number>): void {
    this.dash = [...dash];
  }

  stroke(path?: Path2D): void {
    this.draw(path, (scale) => this.line(scale));
  }

  fill(path?: Path2D | CanvasFillRule): void {
    this.draw(path, () => ` fill="${this.fillStyle}"`);
  }

  fillRect(x: number, y: number, width: number, height: number): void {
    const size = `x="${short(x)}" y="${short(y)}" width="${short(width)}" height="${short(height)}"`;
    this.add("rect", `${size} fill="${this.fillStyle}"`);
  }

  fillText(text: string, x: number, y: number): void {
    this.text(text, x, y, ` fill="${this.fillStyle}"`);
  }

  strokeText(text: string, x: number, y: number): void {
    this.text(text, x, y, this.line(1));
  }

  /** Images of canvases only. */
  drawImage(image: CanvasImageSource, x: number, y: number, width = 0, height = 0): void {
    if (!(image instanceof HTMLCanvasElement)) return;
    const size = `x="${short(x)}" y="${short(y)}" width="${short(width)}" height="${short(height)}"`;
    const look = this.imageSmoothingEnabled ? "" : ' image-rendering="pixelated"';
    this.add("image", `${size} preserveAspectRatio="none"${look} href="${image.toDataURL()}"`);
  }

  private draw(path: Path2D | CanvasFillRule | undefined, style: (scale: number) => string): void {
    if (!(path instanceof Path)) return;
    if (path.d !== "") this.add("path", `d="${path.d}"${style(1)}`);
    for (const { unit, radius, x, y } of path.stamps) {
      const place = `translate(${short(x)} ${short(y)}) scale(${short(radius)})`;
      this.add("path", `d="${unit}" transform="${place}"${style(radius)}`);
    }
  }

  /** A line's style in a drawing that is enlarged by `scale`. */
  private line(scale: number): string {
    const dash = this.dash.length > 0 ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    const width = Math.round((1000 * this.lineWidth) / scale) / 1000;
    return ` fill="none" stroke="${this.strokeStyle}" stroke-width="${width}" stroke-linejoin="${this.lineJoin}" stroke-linecap="${this.lineCap}"${dash}`;
  }

  private text(text: string, x: number, y: number, style: string): void {
    const size = this.font.match(/[\d.]+px/)?.[0] ?? "12px";
    const anchor = { center: "middle", right: "end", end: "end", left: "start", start: "start" };
    const place = `x="${short(x)}" y="${short(y)}" text-anchor="${anchor[this.textAlign]}"`;
    const words = text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
    this.add("text", `${place} font-size="${size}"${style}`, words);
  }

  private add(tag: string, attributes: string, content = ""): void {
    const alpha = this.globalAlpha < 1 ? ` opacity="${short(this.globalAlpha)}"` : "";
    this.elements.push(`<${tag} ${attributes}${alpha}>${content}</${tag}>`);
  }
}
