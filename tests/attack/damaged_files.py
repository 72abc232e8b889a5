# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Attacks by files with flipped bits, overwritten runs of bytes, cuts and changed numbers."""

import json
import shutil

from harness import attack, contents, rows
from material import damaged, map_rows, python


def damaged_copy(case, source, target=None):
    target = target or case.folder / f"damaged{source.suffix}"
    target.write_bytes(damaged(source.read_bytes(), case.random))
    return target


@attack(12)
def image_bytes(case):
    """Among three good images; or asked about."""
    folder = case.folder / "images"
    folder.mkdir()
    for number in range(3):
        shutil.copy(case.material.images / f"00000{number}.png", folder)
    source = case.pick(sorted(case.material.formats.iterdir()))
    image = damaged_copy(case, source, folder / f"{case.random.choice('09')}{source.suffix}")
    if case.random.random() < 0.5:
        out = case.folder / "out"
        run = case.loopbit("run", folder, "--out", out, "--no-report", codes=(0,), keeps=[folder])
        if run.code == 0 and case.expect(len(rows(out)) == 4, "not a row per frame"):
            row = rows(out)[0 if image.name.startswith("0.") else 3]
            if row["status"] == "unreadable":
                case.expect(image.name in run.text, f"an unreadable image is not named: {run.text}")
    else:
        asked = case.loopbit("query", case.material.map, image, "--json", codes=(0, 3),
                             keeps=[case.material.map])
        for line in asked.out.splitlines():
            json.loads(line)


@attack(4)
def video_bytes(case):
    video = damaged_copy(case, case.material.video)
    out = case.folder / "out"
    run = case.loopbit("run", video, "--out", out, "--no-report", codes=(0, 3), keeps=[video],
                       names=video)
    if run.code == 0:
        case.expect(0 < len(rows(out)) <= 2 * 8, f"{len(rows(out))} rows for 8 frames")


@attack(15)
def text_bytes(case):
    """Truth, poses, loop matrices, settings, matches and lists of images."""
    material, out = case.material, case.folder / "out"
    kind, files = case.pick({**material.text_files(), "list": []}.items())
    if kind == "list":
        whole = case.folder / "whole.txt"
        whole.write_text("".join(f"{p}\n" for p in sorted(material.images.iterdir())[:4]))
        files = [whole]
    file = damaged_copy(case, case.random.choice(list(files)))
    truth = ["--truth", file, *case.random.choice([[], ["--tolerance", "3"]])]
    command = {
        "truth": ["eval", material.run, *case.random.choice(
            [truth, ["--truth", material.truth, "--not-false", file],
             ["--truth", material.truth, "--ignore", file]])],
        "poses": case.random.choice([["eval", material.run, *truth], [
            "run", material.images, "--limit", 3, "--poses", file, "--out", out, "--no-report"]]),
        "mat": ["eval", material.run, *truth],
        "config": ["run", material.images, "--limit", 2, "--config", file, "--out", out,
                   "--no-report"],
        "matches": ["eval", file, "--truth", material.truth],
        "list": ["run", file, "--out", out, "--no-report"],
    }[kind]
    case.loopbit(*command, codes=(0, 2, 3), keeps=[file, material.run], names=file)


@attack(10)
def run_folder_bytes(case):
    folder = case.folder / "run"
    shutil.copytree(case.material.run, folder, ignore=shutil.ignore_patterns("report.html"))
    file = case.pick(["run.json", "loops.csv", "evidence.db", "truth.csv", "unknown.csv"])
    damaged_copy(case, folder / file, folder / file)
    page = case.folder / "page.html"
    command = case.random.choice([["eval", folder], ["report", folder, "--out", page],
                                  ["compare", folder, case.material.run, "--truth",
                                   case.material.truth, "--out", page]])
    ran = case.loopbit(*command, codes=(0, 3), keeps=[folder, case.material.run])
    if ran.code == 0 and page in command:
        case.expect(page.exists(), "no page was written")


def answers(case, path):
    """What a map tells: its loops, and the places of an image."""
    image = case.material.images / "000003.png"
    results = [case.loopbit("map", "export", path, "--format", "json", codes=(0, 3)),
               case.loopbit("query", path, image, "--json", codes=(0, 3))]
    return [result.out for result in results]


def saved(path):
    """A map without what its header says of its log, and without the zeros that fill its last page:
    a merge that fails while it writes may have begun a log (docs/format.md)."""
    data = bytearray(path.read_bytes())
    for begin, end in ((18, 20), (24, 28), (40, 44), (92, 100)):
        data[begin:end] = bytes(end - begin)
    return bytes(data).rstrip(b"\0")


def use_map(case, path, signed=False):
    """Uses a map that may be damaged in every way that there is for it. `signed`: its checksums
    are right, so nobody can know that it was changed."""
    check = case.loopbit("map", "check", path, codes=(0, 3), keeps=[path])
    if check.code == 0 and not signed:
        case.expect(answers(case, path) == answers(case, case.material.map),
                    "map check finds nothing, and the answers are others")
    new, images = case.folder / "new.db", case.material.images
    kind = case.random.choice(["recover", "run", "query", "merge", "link", "compact", "images",
                               "info", "list", "export"])
    if kind == "recover":
        recover(case, path, new, signed)
    elif kind in ("run", "compact", "merge", "link"):
        command = {"run": ["run", images, "--limit", 2, "--map", path, "--out",
                           case.folder / "out", "--no-report"],
                   "compact": ["map", "compact", path, "--drop", 1], "link": ["map", "link", path],
                   "merge": case.random.choice([["map", "merge", path, case.material.other_map],
                                                ["map", "merge", new, path]])}[kind]
        # Of a writer that was killed, a run first takes the log into the map.
        killed = path.with_name(path.name + "-wal").exists()
        kept = (saved if kind != "run" else contents if not killed else
                lambda map_path: answers(case, map_path))
        before = kept(path)
        ran = case.loopbit(*command, codes=(0, 2, 3, 4))
        case.expect(ran.code == 0 or kept(path) == before,
                    f"{case.words(ran)}: refused, and yet changed {path.name}: {ran.text}")
    else:
        command = {"query": ["query", path, images / "000002.png"],
                   "images": ["map", "images", path, "--out", case.folder / "images"],
                   "export": ["map", "export", path, "--format", "g2o"]}
        case.loopbit(*command.get(kind, ["map", kind, path]), codes=(0, 3), keeps=[path])


def recover(case, path, new, signed=False):
    ran = case.loopbit("map", "check", path, "--recover", new, codes=(0, 3), keeps=[path])
    if ran.code == 0 and case.expect(new.exists(), "recovered, and yet there is no new map"):
        case.loopbit("map", "check", new, codes=(0,))
        if not signed:
            places = map_rows(case.material.map, by_uid=False)  # a lost uid is given anew
            case.expect(all(places.get(key) == place
                            for key, place in map_rows(new, by_uid=False).items()),
                        "a recovered place is not what was saved")


@attack(15)
def map_bytes(case):
    use_map(case, damaged_copy(case, case.material.map))


@attack(5)
def map_header(case):
    """One byte of the header of a SQLite file has another value; byte 18 = 3 is a later format."""
    path = case.folder / "header.db"
    data = bytearray(case.material.map.read_bytes())
    places = [(18, 3), (18, 1), (19, 3), (16, 0), (21, 255), (56, 2), (44, 9)]
    at, value = (case.pick(places) if case.number < len(places) else
                 (case.random.randrange(100), case.random.randrange(256)))
    data[at] = value
    path.write_bytes(data)
    use_map(case, path)


PYTHON_READS = """
import sys, loopbit
path = sys.argv[1]
def map(path):
    reader = loopbit.MapReader(path)
    reader.places(), reader.loops(), reader.check_structure()
def frames(path):
    for frame in loopbit.open_source(path): pass
def positions(path): loopbit.read_positions(path, [None] * 24)
for read in (loopbit.read_match_list, loopbit.read_truth, loopbit.load_options, loopbit.check_map,
             loopbit.truth_kind, map, frames, positions):
    try: read(path)
    except loopbit.Error as error: assert str(error).endswith("."), error
"""


@attack(4)
def python_reads(case):
    """Every reader of the Python module gets the file, whatever it is. The module leaves stderr to
    its host, so libraries may print there."""
    material = case.material
    sources = [material.map, material.video, *material.formats.iterdir(),
               *(f for files in material.text_files().values() for f in files)]
    file = damaged_copy(case, case.random.choice(sorted(sources)))
    read = case.finish(python(case, PYTHON_READS, file))
    case.expect(read.code == 0, f"{file.suffix}: {read.code} {read.text[-600:]}")
