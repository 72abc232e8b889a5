// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import type { Plugin } from "vite";

const kDataPlace = "@REPORT_DATA@";

const hash = (text: string) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

/** What MIT asks of copies: the notice of the library that is built into the page. */
const license = () =>
  `<!-- Contains uPlot:\n${readFileSync("node_modules/uplot/LICENSE", "utf8").trim()}\n-->`;

/** The page may run and wear exactly what was built into it, and ask nothing of any network. */
function policy(script: string, style: string): string {
  return [
    "default-src 'none'",
    "img-src data: blob:",
    `script-src ${hash(script)}`,
    `style-src ${hash(style)}`,
    // A page that is served while its run goes on has 'self' here; see growing_report().
    "connect-src 'none'",
    "base-uri 'none'",
    "form-action 'none'",
  ].join("; ");
}

/** Replaces the one match of `pattern`; a page that lost it must not be built. */
function replaceOnce(text: string, pattern: RegExp, by: string): string {
  const parts = text.split(pattern);
  if (parts.length !== 2) throw new Error(`${parts.length - 1} matches of ${pattern} in the page`);
  return parts.join(by);
}

/** Puts the one script and the one style sheet of the build into its one page. */
export function oneFile(): Plugin {
  return {
    name: "one-file",
    enforce: "post",
    generateBundle(_, bundle) {
      let script = "";
      let style = "";
      for (const [name, file] of Object.entries(bundle)) {
        if (file.type === "chunk") script += file.code;
        else if (name.endsWith(".css")) style += file.source;
        else continue;
        delete bundle[name];
      }
      // The end of the element would end the script, also within a string.
      script = `\n${script.replaceAll("</script", "<\\/script")}`;
      const page = Object.values(bundle).find((file) => file.fileName === "report.html");
      if (page?.type !== "asset") throw new Error("the build has no report.html");
      let html = String(page.source);
      html = replaceOnce(html, /<script type="module"[^>]*><\/script>/, "");
      html = replaceOnce(html, /<link rel="stylesheet"[^>]*>/, `<style>${style}</style>`);
      html = replaceOnce(html, /@POLICY@/, policy(script, style));
      html = replaceOnce(html, /<\/head>/, `${license()}\n</head>`);
      html = replaceOnce(html, /<\/body>/, `<script type="module">${script}</script>\n</body>`);
      if (html.split(kDataPlace).length !== 2) {
        throw new Error(`the page needs exactly one ${kDataPlace}`);
      }
      page.source = html;
    },
  };
}
