# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Mends the theme Furo as Debian 12 packages it. A complete Furo is left as it is.

Debian ships the parts that upstream bundles: a script that imports another one, though the page does
not load it as a module; a style sheet that imports one from the root of a web server; and no rules
for a dark system, which Debian's Sass compiler drops.
"""

import pathlib
import re


def mend(app, error):
    """Called when Sphinx has written the site."""
    static = pathlib.Path(app.outdir) / "_static"
    if not error and (static / "styles/furo.css").exists():
        edit(static / "scripts/furo.js", with_imported_script)
        edit(static / "styles/furo.css", with_imported_sheet)
        edit(static / "styles/furo.css", with_dark_system)


def edit(path, change):
    path.write_text(change(path.read_text(), path.parent))


def with_imported_script(script, folder):
    found = re.match(r'import Gumshoe from "\./([\w.-]+)";', script)
    if not found:
        return script
    # It looks for a global 'exports', which is also any element with that name.
    imported = f"(function (exports) {{\n{(folder / found[1]).read_text()}\n}})();\n"
    return imported + script[found.end():]


def with_imported_sheet(sheet, _):
    found = re.match(r"@import url\((/javascript/[^)]+)\);", sheet)
    return pathlib.Path(f"/usr/share{found[1]}").read_text() + sheet[found.end():] if found else sheet


def with_dark_system(sheet, _):
    """Repeats the rules of the chosen dark theme for a system that prefers dark."""
    chosen = 'body[data-theme="dark"]'
    rules = re.search(r"@media not print \{\n(  body\[data-theme=\"dark\"\].*?\})\s*\}\n", sheet, re.DOTALL)
    if not rules or "prefers-color-scheme" in sheet:
        return sheet
    dark = rules[1].replace(chosen, 'body:not([data-theme="light"])')
    return f"{sheet}\n@media screen and (prefers-color-scheme: dark) {{\n{dark}\n}}\n"
