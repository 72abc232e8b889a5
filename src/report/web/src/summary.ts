// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import { Comparison } from "./comparison.ts";
import { html } from "./dom.ts";
import * as format from "./format.ts";
import { keyNumbers } from "./key_numbers.ts";
import type { Run } from "./report_data.ts";
import type { RunModel } from "./run_model.ts";
import type { Selection, Store } from "./store.ts";
import type { View } from "./view.ts";

/** The result in one sentence. */
export function sentenceOf(model: RunModel): string {
  const { evaluation } = model.run;
  const loops = model.framesIn("loops").length;
  const elsewhere = model.loopsElsewhere().length;
  const frames = model.run.frames_known ? ` in ${format.counted(model.frames, "frame")}` : "";
  if (!evaluation) {
    const unknown = loops > 0 ? "judge them" : "tell whether one was missed";
    const where =
      elsewhere > 0
        ? `, ${elsewhere === loops ? "all" : `${format.count(elsewhere)} of them`} into earlier sessions of the map`
        : "";
    if (model.isLive) return `${capital(format.counted(loops, "loop"))}${frames} so far${where}.`;
    return `${capital(format.counted(loops, "loop"))} found${frames}${where}; there is no truth to ${unknown}.`;
  }
  const { right, positives, wrong, tolerated } = evaluation;
  const found =
    positives === 0
      ? noRevisits(model)
      : `${format.count(right)} of ${format.counted(positives, "revisit")} found`;
  const also = tolerated > 0 ? `, ${toleratedOf(model, tolerated)}` : "";
  const apart =
    elsewhere > 0
      ? `; ${format.counted(elsewhere, "loop")} into earlier sessions of the map, not judged`
      : "";
  return `${found}, ${format.counted(wrong, "wrong loop")}${also}${apart}.`;
}

/** The truth may list revisits of which none is scored. */
const noRevisits = ({ run }: RunModel) =>
  (run.truth?.same_place.length ?? 0) > 0 ? "No revisit is scored" : "No place was visited twice";

/** A revisit with a tolerated loop counts as missed. */
function toleratedOf(model: RunModel, tolerated: number): string {
  const missed = model.loopsMarked("missed").length;
  const where = missed === 1 ? "a missed revisit" : "missed revisits";
  const at = missed === 0 ? "" : ` (${format.count(missed)} of them at ${where})`;
  return `${format.count(tolerated)} tolerated${at}`;
}

/** "3" if all are the same, otherwise "1 to 3". */
function range(values: readonly number[]): string {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  return low === high ? format.count(low) : `${format.count(low)} to ${format.count(high)}`;
}

/** The results of all runs in one sentence. */
export function sentenceOfAll(models: readonly RunModel[]): string {
  const judged = models.flatMap((model) => model.run.evaluation ?? []);
  if (judged.length < models.length) {
    return `${capital(range(models.map((model) => model.framesIn("loops").length)))} loops found.`;
  }
  const most = Math.max(...judged.map(({ positives }) => positives));
  const found =
    most === 0
      ? "no revisit is scored"
      : `${range(judged.map(({ right }) => right))} of ${format.counted(most, "revisit")} found`;
  return `${capital(found)}, ${range(judged.map(({ wrong }) => wrong))} wrong loops.`;
}

const capital = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);

/** Name, sentence and numbers; with several runs also a table. */
export class Summary implements View {
  readonly element: HTMLElement;
  private readonly title = html("h1");
  private readonly input = html("p", { class: "input" });
  private readonly sentence = html("p", { class: "lead", "data-key": "sentence" });
  private readonly shown = html("p", { class: "shown", "data-key": "shown" });
  private readonly notice = html("p", { class: "notice", role: "note" });
  private readonly numbers = html("div", { class: "key-numbers" });
  private readonly origin = html("p", { class: "origin" });
  private readonly table: Comparison | null;

  constructor(
    store: Store,
    private readonly models: readonly RunModel[],
  ) {
    this.table = models.length > 1 ? new Comparison(store, models) : null;
    this.element = html(
      "header",
      { id: "summary" },
      this.title,
      this.input,
      this.sentence,
      this.notice,
      this.table?.element ?? null,
      this.shown,
      this.numbers,
      this.origin,
    );
  }

  showRun(model: RunModel): void {
    const { run } = model;
    const names = this.models.map((other) => other.run.name);
    this.title.textContent =
      names.length > 1 ? `${names.length} runs: ${names.join(", ")}` : run.name;
    document.title = `${names.length > 1 ? `${names.length} runs` : run.name} - loopbit report`;
    const { path, description } = run.record?.input ?? { path: "", description: "" };
    this.input.textContent = path && `${path} (${description})`;
    this.sentence.textContent = names.length > 1 ? sentenceOfAll(this.models) : sentenceOf(model);
    this.shown.hidden = names.length < 2;
    this.shown.textContent = `Shown below: ${run.name}. ${sentenceOf(model)}`;
    const notice = noticeOf(model);
    this.notice.textContent = notice;
    this.notice.hidden = notice === "";
    this.numbers.replaceChildren(...keyNumbers(model, this.models.length > 1));
    this.origin.replaceChildren(...originOf(run));
    this.table?.show();
  }

  showSelection(_: Selection): void {}
}

function noticeOf({ run: { record, times_ms: times }, isLive }: RunModel): string {
  if (isLive) return "";
  if (record) {
    if (record.stopped_by === "running") {
      return "The run has not ended, or was killed. The page shows its state when the page was written.";
    }
    if (record.stopped_by === "end") return "";
    return record.stopped_by === "interrupt"
      ? "The run was interrupted. The page shows the results so far."
      : `The run stopped early: ${record.stopped_by}`;
  }
  return times
    ? "There is no run.json. The run was cut off; its options and machine are unknown."
    : "";
}

function originOf({ record, evaluation, truth }: Run): HTMLElement[] {
  const parts: string[] = [];
  if (record?.map) parts.push(`map ${record.map.path}, session ${record.map.session}`);
  if (record) {
    const { machine } = record;
    parts.push(
      `loopbit ${record.loopbit}`,
      `${machine.processor}, ${format.counted(machine.cores, "core")}, ${machine.kernel} kernels`,
      format.counted(record.threads, "thread"),
    );
  }
  if (evaluation?.protocol) parts.push(`protocol: ${evaluation.protocol}`);
  if (truth) parts.push(`truth: ${truth.source || "given as values"}`);
  return parts.map((part) => html("span", {}, part));
}
