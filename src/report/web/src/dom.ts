// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

type Attributes = Record<string, string | number | boolean | null | undefined>;
export type Child = Node | string | null;

function fill(target: Element, attributes: Attributes, children: Child[]): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    target.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) {
    if (child !== null) target.append(child);
  }
}

/** An HTML element; attributes that are false, null or undefined are left out. */
export function html<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  fill(made, attributes, children);
  return made;
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  fill(made, attributes, children);
  return made;
}

/** A button that does one thing. */
export function button(
  attributes: Attributes,
  act: () => void,
  ...children: Child[]
): HTMLButtonElement {
  const made = html("button", { type: "button", ...attributes }, ...children);
  made.addEventListener("click", act);
  return made;
}

export function setPressed(target: Element, pressed: boolean): void {
  target.setAttribute("aria-pressed", String(pressed));
}

/** Replaces the content of `container`, and keeps the focus on the same button. */
export function renew(container: HTMLElement, children: readonly Node[]): void {
  const buttons = () => [...container.querySelectorAll("button")];
  const at = buttons().indexOf(document.activeElement as HTMLButtonElement);
  container.replaceChildren(...children);
  if (at >= 0) buttons()[at]?.focus();
}
