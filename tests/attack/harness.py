# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs commands within limits, and writes down what no command may do."""

import functools
import hashlib
import os
import pathlib
import random
import re
import resource
import signal
import subprocess
import sys
import time
import types

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from loopbit_command import LOOPBIT, decisions, rows  # noqa: E402, takes the command's path
from served_command import Server  # noqa: E402

DOCUMENTED_CODES = (0, 2, 3, 4, 130)
MAX_SECONDS = 60  # of the clock: a hang
MAX_CPU_SECONDS = 20
CPU_LIMIT = (resource.RLIMIT_CPU, 2 * MAX_CPU_SECONDS)
MAX_MEMORY_MIB = 1024
MAX_SENTENCE = 10_000  # characters: a path may have 4096
SENTENCE = re.compile(r"loopbit: \S.*\.")
PROGRESS = re.compile(r"\d+( of \d+)? frames, [\d.]+ frames/s.*")
USAGE = re.compile(r"Run with --help for more information\.")
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]")

ATTACKS = {}  # name: (function, share of the tries)


def attack(share=1):
    """Registers a function of one try as the attack of its name."""
    def register(function):
        ATTACKS[function.__name__] = (function, share)
        return function
    return register


class Skipped(Exception):
    """This machine does not permit the attack; the text says what is missing."""


class Result:
    def __init__(self, command, code, out, err, seconds, usage):
        self.command, self.code, self.out, self.err = command, code, out, err
        self.seconds, self.cpu_seconds = seconds, usage.ru_utime + usage.ru_stime
        self.memory_mib = usage.ru_maxrss / 1024
        self.text = err.decode(errors="replace")


def contents(path):
    """What a file, or a folder with all below it, holds: to be compared with later."""
    path = pathlib.Path(path)
    if path.is_dir():
        return {str(p.relative_to(path)): contents(p) for p in sorted(path.rglob("*"))
                if p.is_file()}
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None


def running(process):
    """True until it ends; leaves it to Try.finish(), which asks what it used."""
    return os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None


@functools.cache
def server(_process):
    """Starts the command for a process, which shares it with no other; none if there is no build of it."""
    program = os.environ.get("COMMAND_SERVER")
    return Server(program) if program else None


class Try:
    """One try of an attack: a scratch folder, random numbers of its own, and the faults seen."""

    def __init__(self, name, number, seed, material, folder):
        self.number, self.material, self.folder = number, material, folder
        self.random = random.Random(f"{seed} {name} {number}")
        self.faults = []
        self.about = ""  # what was tried, where the attack's name does not say it

    def fault(self, text):
        self.faults.append(text)

    def expect(self, holds, text):
        if not holds:
            self.fault(text)
        return holds

    def pick(self, choices):
        """Goes round: all are taken, however few the tries."""
        choices = list(choices)
        return choices[self.number % len(choices)]

    def start(self, *arguments, program=None, limits=(), environment=None, cores=None):
        """Begins a command that finish() waits for."""
        def limit():
            for what, value in [CPU_LIMIT, *limits]:
                resource.setrlimit(what, (value, value))
            if cores:
                os.sched_setaffinity(0, cores)

        command = [program or LOOPBIT, *arguments]
        command = [os.fsencode(a if isinstance(a, os.PathLike) else str(a)) for a in command]
        number = len(list(self.folder.glob("stdout*")))
        streams = [open(self.folder / f"{name}{number}", "w+b") for name in ("stdout", "stderr")]
        if server(os.getpid()) and not (program or limits or cores):
            pid = server(os.getpid()).start(command, *streams, environment or {})
            resource.prlimit(pid, CPU_LIMIT[0], (CPU_LIMIT[1], CPU_LIMIT[1]))
            process = types.SimpleNamespace(pid=pid, args=command)
        else:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=streams[0],
                                       stderr=streams[1], preexec_fn=limit,
                                       env={**os.environ, **(environment or {})})
        process.streams, process.begun = streams, time.monotonic()
        return process

    def finish(self, process, max_seconds=MAX_SECONDS):
        """Waits for a command, kills what hangs, and returns the result unjudged."""
        pid, late = 0, False
        while not pid:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if not pid and not late and time.monotonic() - process.begun > max_seconds:
                late = True
                os.kill(process.pid, signal.SIGKILL)
            elif not pid:
                time.sleep(0.005)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - process.begun
        texts = []
        for stream in process.streams:
            stream.seek(0)
            texts.append(stream.read())
            stream.close()
        result = Result(process.args, process.returncode, *texts, seconds, usage)
        if late:
            self.fault(f"{self.words(result)}: no end within {max_seconds} s")
            result.code = None
        return result

    def loopbit(self, *arguments, codes=DOCUMENTED_CODES, keeps=(), names=None, **options):
        """Runs the command, and judges it. `keeps`: files and folders that it must not change;
        `names`: what an error has to name."""
        before = [contents(path) for path in keeps]
        result = self.finish(self.start(*arguments, **options))
        self.judge(result, codes, names)
        for path, content in zip(keeps, before):
            self.expect(contents(path) == content, f"{self.words(result)}: changed {path}")
        return result

    def judge(self, result, codes=DOCUMENTED_CODES, names=None):
        words = self.words(result)
        if result.code is None:
            return
        tail = result.text[-600:]
        if not self.expect(result.code in codes, f"{words}: exit code {result.code}: {tail}"):
            return
        self.expect(result.cpu_seconds < MAX_CPU_SECONDS, f"{words}: {result.cpu_seconds:.0f} s")
        self.expect(result.memory_mib < MAX_MEMORY_MIB, f"{words}: {result.memory_mib:.0f} MiB")
        self.judge_text(result, words, names)

    def judge_text(self, result, words, names):
        for stream in (result.out, result.err):
            control = CONTROL.search(stream)
            self.expect(not control, f"{words}: prints {control and control[0]!r}")
        lines = result.text.splitlines()
        usage = result.code == 2 and bool(lines) and USAGE.fullmatch(lines[-1])
        if usage:
            return
        for line in lines:
            ours = SENTENCE.fullmatch(line) or PROGRESS.fullmatch(line)
            self.expect(ours and len(line) < MAX_SENTENCE and "internal error" not in line,
                        f"{words}: no line of ours: {line[:300]!r}")
        if result.code in (2, 3, 4):
            error = lines[-1] if lines else ""
            if result.command[1:3] != [b"map", b"check"] or error:  # which lists damage on stdout
                self.expect(SENTENCE.fullmatch(error), f"{words}: says no error: {error!r}")
            if names and error:
                self.expect(str(names) in result.text, f"{words}: names no {names}: {error}")

    def words(self, result):
        """The command as a shell takes it, its files in this try's folder."""
        return " ".join(os.fsdecode(a).replace(str(self.folder), "TRY")
                        for a in ["loopbit", *result.command[1:]])[:400]


def decided_alike(case, folder, reference, words):
    """True if a run decided what the undisturbed one did, as far as it came."""
    found = decisions(pathlib.Path(folder))
    return case.expect(found == reference[:len(found)], f"{words}: rows differ from those of a run "
                                                        f"that nothing disturbed")
