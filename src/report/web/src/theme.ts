// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

/** The colours of the canvases; base.css defines them. */
const kNames = [
  "paper",
  "ink",
  "muted",
  "faint",
  "rule",
  "right",
  "wrong",
  "missed",
  "tolerated",
  "loop",
  "elsewhere",
  "ignored",
  "path",
  "step-content",
  "step-retrieval",
  "step-features",
  "step-verification",
] as const;

export type ColourName = (typeof kNames)[number];
export type Theme = Readonly<Record<ColourName, string>> & { readonly font: string };
export type Scheme = "light" | "dark";

const preferred = matchMedia("(prefers-color-scheme: dark)");
const printing = matchMedia("print");
let chosen: Scheme | null = null;
const listeners: (() => void)[] = [];

function read(): Theme {
  const style = getComputedStyle(document.documentElement);
  const colours = Object.fromEntries(
    kNames.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]),
  ) as Record<ColourName, string>;
  return { ...colours, font: style.getPropertyValue("--font").trim() };
}

function apply(): void {
  document.documentElement.dataset["theme"] = scheme();
  current = read();
  for (const listener of listeners) listener();
}

/** Printed pages are always light. */
export function scheme(): Scheme {
  if (printing.matches || document.documentElement.classList.contains("printing")) return "light";
  return chosen ?? (preferred.matches ? "dark" : "light");
}

export function toggleScheme(): void {
  chosen = scheme() === "dark" ? "light" : "dark";
  apply();
}

export function onThemeChange(listener: () => void): void {
  listeners.push(listener);
}

let current: Theme = read();
export const theme = (): Theme => current;

export function startTheme(): void {
  preferred.addEventListener("change", apply);
  apply();
}

/** Called before and after printing. */
export function refreshTheme(): void {
  apply();
}
