// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { button, html } from "./dom.ts";
import * as format from "./format.ts";
import type { RunRecord } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection } from "./store.ts";
import type { View } from "./view.ts";

type Options = RunRecord["options"];

/** Output folder of a repeated run, so that the first one is kept. */
const kNewFolder = "again";

/** Quotes a word for the shell if needed. */
const quoted = (text: string) =>
  /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;

/** "part.name", value pairs of all settings. */
function flat(options: Options): [string, string][] {
  return Object.entries(options).flatMap(([part, settings]) =>
    Object.entries(settings).map(([name, value]): [string, string] => [
      `${part}.${name}`,
      String(value),
    ]),
  );
}

/** The settings that differ from `defaults`. */
function changed(options: Options, defaults: Options): [string, string][] {
  const usual = new Map(flat(defaults));
  return flat(options).filter(([name, value]) => usual.get(name) !== value);
}

/** The command of the run, with another folder to write to. */
function commandOf(given: readonly string[]): string {
  const words: string[] = [];
  const end = given.includes("--") ? given.indexOf("--") : given.length;
  let hasOut = false;
  for (let i = 0; i < end; ++i) {
    const word = given[i] ?? "";
    if (word === "--overwrite") continue;
    const isOut = word === "--out" || word.startsWith("--out=");
    if (word === "--out") ++i;
    if (!isOut) words.push(word);
    else if (!hasOut) words.push("--out", kNewFolder);
    hasOut ||= isOut;
  }
  if (!hasOut) words.push("--out", kNewFolder);
  return ["loopbit", ...words, ...given.slice(end)].map(quoted).join(" ");
}

/** Describes a run that was not started by a command. */
function inputOf({ arguments: given, input }: RunRecord): string {
  const who = given
    ? "The run was started through the library, not by the command."
    : "The record does not say how the run was started.";
  const parts = [`${input.path} (${input.description})`];
  if (input.every > 1) parts.push(`one of every ${input.every} frames`);
  if (input.limit > 0) parts.push(`at most ${format.counted(input.limit, "frame")}`);
  return `${who} Input: ${parts.join(", ")}.`;
}

/** The origin of the run, and how to repeat it. */
export class Footer implements View {
  readonly element: HTMLElement;
  private readonly details = html("div", { class: "origin-details" });
  private readonly origin = html("p", { class: "small" });

  constructor(
    private readonly version: string,
    private readonly defaults: Options | undefined,
  ) {
    this.element = html("footer", {}, html("h2", {}, "About this run"), this.details, this.origin);
  }

  showRun(model: RunModel): void {
    const loads = model.isLive
      ? "This page asks nobody but the loopbit that serves it, and sends nothing else."
      : "This page is self-contained: it loads nothing and sends nothing.";
    this.origin.textContent = `Written by loopbit ${this.version}. ${loads}`;
    const { record } = model.run;
    if (!record) {
      this.details.replaceChildren(
        html("p", {}, "There is no record of this run. Its options and machine are unknown."),
      );
      return;
    }
    const given = record.arguments ?? [];
    this.details.replaceChildren(
      html("h3", {}, given.length > 0 ? "Run it again" : "Input and settings"),
      given.length > 0 ? command(commandOf(given)) : html("p", {}, inputOf(record)),
      ...(this.defaults
        ? [html("p", { class: "small" }, differing(record.options, this.defaults))]
        : []),
      html("h3", {}, "Machine"),
      machine(record),
      settings(record.options, this.defaults),
    );
  }

  showSelection(_: Selection): void {}
}

function differing(options: Options, defaults: Options): string {
  const list = changed(options, defaults).map(([name, value]) => `${name} = ${value}`);
  return list.length === 0
    ? "All settings have their default values."
    : `Changed settings: ${list.join(", ")}.`;
}

function command(text: string): HTMLElement {
  const copy = button({ class: "quiet" }, () => void navigator.clipboard?.writeText(text), "copy");
  return html("div", { class: "command" }, html("code", { "data-key": "command" }, text), copy);
}

function machine({ machine, threads, wall_s, peak_memory_mib }: RunRecord): HTMLElement {
  const facts = [
    machine.processor,
    format.counted(machine.cores, "core"),
    `${machine.kernel} kernels`,
    machine.system,
    format.counted(threads, "thread"),
  ];
  if (wall_s !== undefined) facts.push(`${wall_s.toFixed(1)} s in total`);
  if (peak_memory_mib !== undefined) facts.push(`${peak_memory_mib.toFixed(0)} MiB peak memory`);
  return html("p", {}, facts.join(", "));
}

function settings(options: Options, defaults: Options | undefined): HTMLElement {
  const unusual = new Set(defaults ? changed(options, defaults).map(([name]) => name) : []);
  const rows = flat(options).map(([name, value]) =>
    html(
      "tr",
      { class: unusual.has(name) ? "changed" : null },
      html("th", { scope: "row" }, name),
      html("td", { "data-key": `options.${name}` }, value),
    ),
  );
  const table = html(
    "table",
    { class: "numbers settings" },
    html("caption", {}, "All settings of the run; 'loopbit options' describes them"),
    html("tbody", {}, ...rows),
  );
  return html("details", {}, html("summary", {}, `All ${rows.length} settings`), table);
}
