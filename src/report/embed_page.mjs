// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// embed_page.mjs PAGE SOURCE: writes a C++ source that holds the page as a string. Bytes are
// read and written one by one, so that none of them is cut within a character.
import { readFileSync, writeFileSync } from "node:fs";

const [page, source] = process.argv.slice(2);
const text = readFileSync(page, "latin1");
if (text.includes(')page"')) throw new Error(`${page} holds the end of a C++ string`);
const literals = [];
for (let begin = 0; begin < text.length; begin += 16000) {
  literals.push(`R"page(${text.slice(begin, begin + 16000)})page"`);
}
writeFileSync(
  source,
  `#include "report_page.hpp"\n\nconst std::string_view loopbit::report::kPage =\n${literals.join("\n")};\n`,
  "latin1",
);
