#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Attacks the loopbit command, its maps and its Python module, and counts the faults.

    attack.py LOOPBIT MAP_CRASH MODULE FINDINGS [TRIES [SEED [NAME[:NUMBER] ...]]]

Prints a line 'attack NAME tries=N faults=N' for each attack and one for all. A try with a fault
leaves its folder in FINDINGS; NAME:NUMBER repeats it alone. Exit code 1: there was a fault.
"""

import concurrent.futures
import os
import pathlib
import shutil
import signal
import sys
import tempfile
import time
import traceback

import crafted_maps  # noqa: F401, registers its attacks
import damaged_files  # noqa: F401
import disturbed_runs  # noqa: F401
import hostile_inputs  # noqa: F401
import shared_maps  # noqa: F401
from harness import ATTACKS, Skipped, Try
from material import Material


def one_try(name, number, seed, material, scratch, findings):
    """Returns the faults of a try, or a text: why it was skipped."""
    folder = scratch / f"{name}_{number}"
    folder.mkdir()
    case = Try(name, number, seed, material, folder)
    try:
        ATTACKS[name][0](case)
    except Skipped as reason:
        return str(reason)
    except Exception:  # the attack itself fails where what it reads is not as promised
        case.fault(traceback.format_exc(limit=-3))
    finally:
        if case.faults:
            (folder / "faults.txt").write_text("\n".join([case.about, *case.faults]) + "\n")
            shutil.copytree(folder, findings / folder.name, symlinks=True, dirs_exist_ok=True,
                            copy_function=copy_file)
        shutil.rmtree(folder, ignore_errors=True)
    return [f"{case.about} {fault}".strip() for fault in case.faults]


def copy_file(source, target):
    if os.path.isfile(source):  # no pipe and no device
        shutil.copy2(source, target)


def plan(tries, names):
    """Names and numbers of the tries, the slow attacks spread among the quick."""
    alone = [name.split(":") for name in names if ":" in name]
    names = [name for name in names if ":" not in name] or ([] if alone else list(ATTACKS))
    total = sum(ATTACKS[name][1] for name in names)
    planned = [(index / count, name, index) for name in names
               for count in [max(1, round(tries * ATTACKS[name][1] / total))]
               for index in range(count)]
    return ([(name, number) for _, name, number in sorted(planned)]
            + [(name, int(number)) for name, number in alone])


def main():
    if len(sys.argv) < 4:  # loopbit_command.py has taken the first
        sys.exit(__doc__)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it, and so would what it starts
    map_crash, module, findings = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
    tries = int(sys.argv[4]) if len(sys.argv) > 4 else 3000
    seed = int(sys.argv[5]) if len(sys.argv) > 5 else 2019
    begun = time.monotonic()
    shutil.rmtree(findings, ignore_errors=True)
    findings.mkdir(parents=True)
    with tempfile.TemporaryDirectory(prefix="loopbit_attack_") as folder:
        folder = pathlib.Path(folder)
        material = Material(map_crash, module, folder / "material").make()
        scratch = folder / "tries"
        scratch.mkdir()
        with concurrent.futures.ProcessPoolExecutor() as workers:
            running = {one: workers.submit(one_try, *one, seed, material, scratch, findings)
                       for one in plan(tries, sys.argv[6:])}
            results = {one: result.result() for one, result in running.items()}
    return report(results, time.monotonic() - begun)


def report(results, seconds):
    for (name, number), found in results.items():
        if isinstance(found, list):
            for fault in found:
                print(f"fault {name}:{number} {fault}")
    counts = {}
    for (name, _), found in results.items():
        count = counts.setdefault(name, [0, 0, set()])
        if isinstance(found, str):
            count[2].add(found)
        else:
            count[0] += 1
            count[1] += bool(found)
    for name, (tries, faults, skipped) in sorted(counts.items()):
        why = "".join(f" skipped: {reason}" for reason in sorted(skipped))
        print(f"attack {name} tries={tries} faults={faults}{why}")
    tries, faults = (sum(count[i] for count in counts.values()) for i in (0, 1))
    print(f"attack tries={tries} faults={faults} seconds={seconds:.0f}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
