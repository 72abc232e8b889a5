// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT

import type { CurvePoint, Evaluation } from "./report_data.ts";

/** Shares; null if the denominator is 0. */
export interface Figures {
  recall: number | null;
  precision: number | null;
  recallAtFullPrecision: number | null;
  averagePrecision: number | null;
  pairRecall: number | null;
}

export function figuresOf(evaluation: Evaluation): Figures {
  const { positives, right, wrong, pairs } = evaluation;
  const ofRevisits = (value: number) => (positives > 0 ? value : null);
  return {
    recall: ofRevisits(evaluation.recall),
    precision: right + wrong > 0 ? evaluation.precision : null,
    recallAtFullPrecision: ofRevisits(evaluation.recall_at_full_precision),
    averagePrecision: ofRevisits(evaluation.average_precision),
    pairRecall: pairs.positives > 0 ? pairs.recall : null,
  };
}

/** The points of the curve that have both a recall and a precision. */
export function curveOf(evaluation: Evaluation | null): readonly CurvePoint[] {
  if (!evaluation || evaluation.positives === 0) return [];
  return evaluation.curve.filter(({ right, wrong }) => right + wrong > 0);
}
