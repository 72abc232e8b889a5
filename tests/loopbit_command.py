# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What the tests of the loopbit command share. A test of it is run as

    NAME_test.py LOOPBIT [--quick] [unittest arguments]

--quick drives in fewer, wider steps, which suits a build with sanitizers; what is found is not judged then.
"""

import contextlib
import csv
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

from served_command import TIME_LIMIT_S, run_command

LOOPBIT = pathlib.Path(sys.argv.pop(1)).resolve()
QUICK = "--quick" in sys.argv
if QUICK:
    sys.argv.remove("--quick")
# For a case that reaches no branch in src/ that other sanitized tests do not reach, as Clang's coverage counts
# them. Damaged input and what ends a process by force are tested in any case.
repeats_when_sanitized = unittest.skipIf(QUICK, "sanitized elsewhere")
# A small town: two laps of a short circuit, in pictures that are quick to draw.
FRAMES = 40 if QUICK else 150
WORLD = ["--frames", FRAMES, "--world", "laps=2", "--world", f"spacing_m={225 / FRAMES}",
         "--world", "width_px=320", "--world", "height_px=240"]


def loopbit(*arguments, **options):
    """Runs the command, see run_command()."""
    return run_command(LOOPBIT, *arguments, **options)


@contextlib.contextmanager
def started(*arguments):
    """A process of the command, for a `with` block that talks to it. It is killed if it still runs at the end of the
    block, even one that was stopped, or after TIME_LIMIT_S."""
    with subprocess.Popen([LOOPBIT, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as process:
        watchdog = threading.Timer(TIME_LIMIT_S, process.kill)
        watchdog.start()
        try:
            yield process
        finally:
            watchdog.cancel()
            process.kill()


def complaints(ran):
    """What a run says in stderr, but for the progress that it shows if it takes more than seconds."""
    return [line for line in ran.stderr.splitlines() if " frames/s, " not in line]


def rows(folder):
    with open(folder / "loops.csv", newline="") as file:
        return list(csv.DictReader(file))


def decisions(folder):
    """loops.csv without times, which differ from run to run, and names, which inputs choose."""
    return [{k: v for k, v in row.items() if not k.endswith(("_ms", "name"))}
            for row in rows(folder)]


class CommandTest(unittest.TestCase):
    """Each case has a scratch folder; all share a drive through a small town and a run on it."""

    @classmethod
    def setUpClass(cls):
        cls.shared = pathlib.Path(tempfile.mkdtemp(prefix="loopbit_cli_"))
        cls.dataset = cls.shared / "dataset"
        made = loopbit("demo", *WORLD, "--write-images", cls.dataset)
        assert made.returncode == 0, made.stderr
        cls.images = cls.dataset / "images"
        cls.reference = cls.shared / "reference"
        ran = loopbit("run", cls.images, "--out", cls.reference, "--truth",
                      cls.dataset / "truth.csv", "--not-false", cls.dataset / "not_false.csv")
        assert ran.returncode == 0, ran.stderr
        cls.reference_output = ran.stdout

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.shared)

    def setUp(self):
        self.scratch = pathlib.Path(tempfile.mkdtemp(prefix="case_", dir=self.shared))
        self.out = self.scratch / "out"

    def few_images(self, number=14):
        """A folder with the first images of the world."""
        folder = self.scratch / "few"
        folder.mkdir()
        for image in sorted(self.images.iterdir())[:number]:
            shutil.copy(image, folder)
        return folder

    def assert_fails(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stderr)
        for word in words:
            self.assertIn(str(word), result.stderr)
        sentences = [line for line in result.stderr.splitlines() if line.startswith("loopbit: ")]
        self.assertEqual(len(sentences), 1, result.stderr)
