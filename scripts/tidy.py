#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs clang-tidy over the sources of src/ and tools/ in a finished build.

A source is skipped if nothing that affects its result has changed since it last passed: its
compile command, the .clang-tidy file, clang-tidy itself, and the content of our files that it
includes (as the compiler reported them to Ninja). The others are checked together, as far as they can
be compiled together, because most of the time goes into the headers that they share. --all also
checks tests, benchmarks and the Python module, and runs the static analyzer. It takes several times as
long and checks one source at a time.
"""

import argparse
import hashlib
import itertools
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

TIDY = "clang-tidy-14"
CLANG = "clang++-14"
# The static analyzer takes as long as all other checks, and a minute for a large test.
# performance-unnecessary-value-param takes 40 % of the remaining time, for the functions of system
# headers. The other checks listed here take about half of it. Their faults are rare, are found by compilers,
# too, or cannot occur in C++20.
QUICK = ["--checks=-clang-analyzer-*,-performance-unnecessary-value-param,-bugprone-reserved-identifier,"
         "-bugprone-stringview-nullptr,-bugprone-suspicious-string-compare,-bugprone-multiple-statement-macro,"
         "-modernize-use-transparent-functors,-modernize-deprecated-ios-base-aliases,-modernize-replace-auto-ptr,"
         "-modernize-use-noexcept,-modernize-use-uncaught-exceptions,-modernize-redundant-void-arg,"
         "-modernize-use-using,-misc-unused-using-decls,-misc-definitions-in-headers,-bugprone-suspicious-semicolon,"
         "-bugprone-unused-raii,-bugprone-sizeof-expression,-bugprone-not-null-terminated-result,"
         "-readability-redundant-declaration,-readability-static-definition-in-anonymous-namespace,"
         "-bugprone-infinite-loop,-bugprone-assert-side-effect,-cppcoreguidelines-slicing,-modernize-use-bool-literals,"
         "-modernize-use-nullptr,-readability-redundant-control-flow",
         # Bodies of templates that nobody uses, of which system headers are full, are not parsed.
         "--extra-arg=-fdelayed-template-parsing"]
# A source includes no other, but a batch does; and may shadow names of another, for which compilers check each target.
BATCHED = [QUICK[0] + ",-bugprone-suspicious-include", *QUICK[1:], "--extra-arg=-Wno-shadow"]
ROOT = pathlib.Path(__file__).resolve().parent.parent


def included_files(build):
    """The files each object was compiled from, by object."""
    listing = subprocess.run(
        ["ninja", "-C", build, "-t", "deps"], check=True, capture_output=True, text=True
    ).stdout
    files, current = {}, []
    for line in listing.splitlines():
        if line.startswith(" "):
            current.append((build / line.strip()).resolve())
        elif line:
            current = files[line.split(": #deps ")[0]] = []
    return files


def is_ours(file):
    return file.is_relative_to(ROOT)


def fingerprint(entry, files, common):
    digest = hashlib.sha256(common + entry["command"].encode())
    for file in sorted(filter(is_ours, files)):
        digest.update(str(file.relative_to(ROOT)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def entries_of(build):
    """How each source is compiled, or would be: CMake compiles some together."""
    for entry in json.loads((build / "compile_commands.json").read_text()):
        file = pathlib.Path(entry["file"])
        if file.parent.name != "Unity":
            yield entry
            continue
        for source in re.findall(r'^#include "(.+)"$', file.read_text(), re.MULTILINE):
            yield {**entry, "file": source,
                   "command": entry["command"].replace(entry["file"], source)}


def check(source, stamp, flags, options):
    """What clang-tidy found in a source, or nothing, which the stamp then remembers."""
    result = subprocess.run(
        [TIDY, "--quiet", *options, source, "--", *flags], capture_output=True, text=True
    )
    if result.returncode == 0:
        stamp.touch()
        return ""
    return result.stdout or result.stderr or f"{source}: exit code {result.returncode}\n"


def split_flags(entry):
    """What a source is compiled with, but its own name and that of its object: where headers and
    definitions come from, and the rest."""
    command = iter(shlex.split(entry["command"])[1:])
    places, others = [], []
    for part in command:
        if part == "-isystem":
            places.append((part, next(command)))
        elif part.startswith(("-I", "-D")):
            places.append((part,))
        elif part in ("-o", "-include"):
            next(command)
        elif part not in ("-c", entry["file"], "-fPIC") and not part.startswith(("-fvisibility", "-O", "--param")):
            others.append(part)
    return places, tuple(others)


def flags_of(places, others):
    """Flags for clang-tidy, of all places in the order in which they first stand."""
    return [*itertools.chain(*dict.fromkeys(itertools.chain(*places))), *others]


def written(sources, build):
    """A source that includes those given."""
    text = "".join(f'#include "{source}"\n' for source in sources)
    file = build / "tidy_batches" / f"{hashlib.sha256(text.encode()).hexdigest()}.cpp"
    file.write_text(text)
    return file


def files_with_faults(output):
    """The files that clang or clang-tidy says something of."""
    return set(re.findall(r"^(/.+?):\d+:\d+: (?:fatal )?(?:error|warning):", output, re.MULTILINE))


def check_batch(sources, flags, pending, build):
    """As check(), of several sources together, with flags for all. Those in which that finds faults are
    checked again by themselves: a batch may show some that they do not have."""
    result = subprocess.run([TIDY, "--quiet", *BATCHED, f"--config-file={ROOT}/.clang-tidy",
                             written(sources, build), "--", *flags], capture_output=True, text=True)
    if "[clang-diagnostic-error]" in result.stdout:
        together = that_compile_together(sources, flags, build)
        rest = [source for source in sources if source not in together]
        if rest:
            print("clang-tidy: checked later, because they define names that others define, too:", *rest)
            return check_batch(together, flags, pending, build) + check_batch(rest, flags, pending, build)
    faulty = files_with_faults(result.stdout) if result.returncode != 0 else set()
    if result.returncode != 0 and not (faulty and faulty <= set(map(str, sources))):
        return [result.stdout or result.stderr]  # a header's
    for source in sources:
        if str(source) not in faulty:
            pending[source].touch()
    return [check(source, pending[source], flags, QUICK) for source in sources if str(source) in faulty]


def that_compile_together(sources, flags, build):
    """Some of the sources. Two cannot be compiled as one if both define the same name."""
    while len(sources) > 1:
        result = subprocess.run([CLANG, "-fsyntax-only", "-ferror-limit=0", "-w",
                                 written(sources, build), *flags], capture_output=True, text=True)
        if result.returncode == 0:
            break
        faulty = files_with_faults(result.stderr)
        good = [source for source in sources if str(source) not in faulty]
        sources = good if 0 < len(good) < len(sources) else sources[:len(sources) // 2]
    return sources


def batches(todo):
    """All sources, those together that are compiled alike, and the flags for each lot."""
    by_others = {}
    for source, entry in todo.items():
        places, others = split_flags(entry)
        by_others.setdefault(others, {})[source] = places
    for others, places in by_others.items():
        yield list(places), flags_of(places.values(), others)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path, help="folder of a finished Ninja build")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--all", action="store_true",
                        help="tests, benchmarks and the Python module, too, and the static analyzer")
    arguments = parser.parse_args()
    build = arguments.build.resolve()

    version = subprocess.run([TIDY, "--version"], check=True, capture_output=True).stdout
    options = [] if arguments.all else QUICK
    common = version + " ".join(options).encode() + (ROOT / ".clang-tidy").read_bytes()
    files = included_files(build)
    stamps = build / "tidy"
    stamps.mkdir(exist_ok=True)

    todo, pending, passed, seen = {}, {}, set(), set()
    for entry in entries_of(build):
        source = pathlib.Path(entry["file"])
        if source in seen:
            continue  # compiled for several instruction sets, of which one is checked
        seen.add(source)
        if not is_ours(source) or source.is_relative_to(build):
            continue
        if not arguments.all and source.relative_to(ROOT).parts[0] not in ("src", "tools"):
            continue
        command = shlex.split(entry["command"])
        output = command[command.index("-o") + 1]
        if output not in files:
            sys.exit(f"tidy.py: {source} is not compiled yet; build {build} first.")
        stamp = stamps / fingerprint(entry, files[output], common)
        if stamp.exists():
            passed.add(stamp)
        else:
            todo[source] = entry
            pending[source] = stamp
    for stale in set(stamps.iterdir()) - passed:
        stale.unlink()

    def check_alone(source):
        places, others = split_flags(todo[source])
        return check(source, pending[source], flags_of([places], others), options)

    with ThreadPoolExecutor(arguments.jobs) as pool:
        if arguments.all:
            findings = list(pool.map(check_alone, todo))
        else:
            (build / "tidy_batches").mkdir(exist_ok=True)
            found = pool.map(lambda batch: check_batch(*batch, pending, build), batches(todo))
            findings = [finding for of_batch in found for finding in of_batch]
    print("".join(findings), end="")
    failed = sum(map(bool, findings))
    print(f"clang-tidy: {len(passed)} unchanged, {len(todo) - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
