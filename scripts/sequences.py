# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""The sequences of the benchmarks, and a runner for them."""

import argparse
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# name: input, truth, matches that are not false, queries that are not scored
REAL = {
    "corridor_loop": ("corridor_loop/images", "corridor_loop/truth.csv",
                      "corridor_loop/not_false.csv", "corridor_loop/ignore.csv"),
    "kitti03": ("kitti03/images", None, None, None),
    "kitti03 two pass (artificial)": ("kitti03/two_pass_order.txt", "kitti03/two_pass_truth.csv",
                                      None, None),
    "office_tour": ("office_tour/images", "office_tour/truth.csv", "office_tour/not_false.csv",
                    None),
    "euroc_room": ("euroc_room/images", "euroc_room/truth.csv", "euroc_room/not_false.csv", None),
    "lateral_corridor": ("lateral_corridor/images", "lateral_corridor/truth.csv", None, None),
    **{f"gardens_point {name.replace('_', ' ')}": (
        f"gardens_point/{name}.txt", "gardens_point/truth.csv", "gardens_point/not_false.csv", None)
       for name in ("left_then_right", "right_then_night", "left_then_night")},
}
WORLDS = {
    "world 1": {"seed": 1},
    "world 2": {"seed": 2},
    "world 3": {"seed": 3},
    "world 5, all houses alike": {"seed": 5, "look_alike": 1},
    "world 6, 2.5 m beside": {"seed": 6, "lateral_offset_m": 2.5},
    "world 7, other light, busy": {"seed": 7, "light_change": 1, "moving_objects": 1},
}


def parser(description):
    """The arguments that all measurements share."""
    result = argparse.ArgumentParser(description=description)
    result.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    default = os.environ.get("LOOPBIT_DATA") or ROOT.parent / "shared/data"
    result.add_argument("--data", type=pathlib.Path, default=default)
    return result


def world_command(settings):
    settings = dict(settings)
    command = ["demo", "--seed", str(settings.pop("seed", 1))]
    for name, value in settings.items():
        command += ["--world", f"{name}={value}"]
    return command


def command_of(build):
    """The path of the command; builds it first if `build` is a revision."""
    if os.access(build, os.X_OK) and pathlib.Path(build).is_file():
        return pathlib.Path(build).resolve()
    return build_revision(build, "loopbit_cli", "src/cli/loopbit")


def build_revision(revision, target, program, prepare=lambda tree: None):
    """The path of a program of an earlier revision, built where it is not yet. prepare(tree) may
    change the tree before."""
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--verify", "--quiet",
                             f"{revision}^{{commit}}"], capture_output=True, text=True).stdout.strip()
    if not commit:
        sys.exit(f"{revision} is neither a program nor a revision.")
    tree = ROOT / "build/revisions" / commit
    built = tree / "build/release" / program
    if not built.exists():
        print(f"building {revision} in {tree}", file=sys.stderr)
        tree.mkdir(parents=True, exist_ok=True)
        archive = subprocess.run(["git", "-C", ROOT, "archive", commit], check=True,
                                 capture_output=True).stdout
        subprocess.run(["tar", "-x", "-C", tree], input=archive, check=True)
        prepare(tree)
        call("cmake", "--preset", "release", "--log-level=WARNING", cwd=tree)
        call("cmake", "--build", "--preset", "release", "--target", target, "--parallel",
             str(os.cpu_count()), cwd=tree)
    return built


def call(*command, cwd=None):
    done = subprocess.run(command, cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}")


def odometry_of(poses, out, *flags):
    """Writes odometry that drifts, made from true poses, to the file `out`, and returns that."""
    with open(out, "w") as file:
        subprocess.run([ROOT / "scripts/make_odometry", poses, *flags], check=True, stdout=file)
    return out


class Runner:
    """Runs `loopbit` with one thread; keeps its folders in `scratch`."""

    def __init__(self, args, scratch):
        self.loopbit = args.build / "src/cli/loopbit"
        if not self.loopbit.exists():
            sys.exit(f"There is no {self.loopbit}; build it with 'cmake --build --preset release'.")
        self.data = args.data
        self.scratch = pathlib.Path(scratch)
        self.runs = 0

    def truth_flags(self, name):
        _, truth, not_false, ignore = REAL[name]
        if truth is None:  # a drive without revisit: every loop is wrong
            truth = self.scratch / "none.csv"
            truth.write_text("query,first,last\n")
        flags = []
        for flag, file in (("--truth", truth), ("--not-false", not_false), ("--ignore", ignore)):
            if file:
                flags += [flag, self.data / file]
        return flags

    def real(self):
        """Yields the names of the real sequences that are there, and names the others."""
        for name, (images, *_) in REAL.items():
            if (self.data / images).exists():
                yield name
            else:
                print(f"{name}: left out, there is no {self.data / images}", file=sys.stderr)

    def real_command(self, name):
        """The command that runs a real sequence with its truth."""
        return ["run", self.data / REAL[name][0], *self.truth_flags(name)]

    def sequences(self):
        """Yields a name and the command that runs it with its truth."""
        for name in self.real():
            yield name, self.real_command(name)
        for name, settings in WORLDS.items():
            yield name, world_command(settings)

    def call(self, *arguments):
        subprocess.run([self.loopbit, *arguments], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)

    def run(self, command, flags=()):
        """run.json of a run."""
        out = self.scratch / str(self.runs)
        self.runs += 1
        self.call(*command, "--out", out, "--threads", "1", "--no-report", *flags)
        return json.loads((out / "run.json").read_text())

    def last_folder(self):
        return self.scratch / str(self.runs - 1)

    def score_of_matches(self, matches, truth_flags=()):
        """What `loopbit eval` says about a list of matches, or a folder of a run with its truth."""
        done = subprocess.run([self.loopbit, "eval", matches, *truth_flags, "--json"], check=True,
                              capture_output=True, text=True)
        return json.loads(done.stdout)


def highest_wrong(score):
    """The score of the wrong match that scored highest: the curve goes from high scores to low."""
    return next((point["score"] for point in score["curve"] if point["wrong"] > 0), 0.0)


def machine(record):
    return f"{record['machine']['processor']}, {record['machine']['kernel']} kernels"
