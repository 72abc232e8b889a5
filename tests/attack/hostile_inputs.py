# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Attacks by what stands where a file is expected, by meaningless text, names and pixels."""

import itertools
import json
import os
import pathlib
import random
import shutil
import socket
import stat
import struct

from harness import attack, decided_alike, decisions
from material import TINY, png, python

SPECIAL = ("pipe", "zero", "null", "full", "folder", "socket", "broken_link", "link_loop", "empty",
           "below_a_file")


def make_special(kind, path):
    """Devices are made anew: one of the system's could be replaced by root."""
    devices = {"zero": (1, 5), "null": (1, 3), "full": (1, 7)}
    if kind in devices:
        try:
            os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(*devices[kind]))
        except PermissionError:  # then nobody could replace it either
            path.symlink_to(f"/dev/{kind}")
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "socket":
        server = socket.socket(socket.AF_UNIX)
        here = os.getcwd()
        os.chdir(path.parent)  # a socket's name may have 107 bytes
        server.bind(path.name)
        os.chdir(here)
        server.close()
    elif kind in ("broken_link", "link_loop"):
        path.symlink_to(path.name if kind == "link_loop" else "nothing")
    else:
        path.touch()
    return path / "x" if kind == "below_a_file" else path


def places_of_a_file(case, special):
    """Commands that read or write the special file, by name of the place."""
    material, out = case.material, case.folder / "out"
    run = ["run", material.images, "--limit", 2, "--no-report", "--out", out]
    image = material.images / "000002.png"
    return {
        "input": ["run", special, "--no-report", "--out", out],
        "truth": [*run, "--truth", special], "poses": [*run, "--poses", special],
        "not_false": [*run, "--truth", material.truth, "--not-false", special],
        "ignore": [*run, "--truth", material.truth, "--ignore", special],
        "config": [*run, "--config", special], "map": [*run, "--map", special],
        "out": [*run[:-1], special], "image": ["query", material.map, special],
        "asked_map": ["query", special, image], "checked": ["map", "check", special],
        "info": ["map", "info", special], "exported": ["map", "export", special],
        "merged": ["map", "merge", out, special], "into": ["map", "merge", special, material.map],
        "compacted": ["map", "compact", special, "--drop", 1], "linked": ["map", "link", special],
        "recovered": ["map", "check", material.map, "--recover", special],
        "export": ["map", "export", material.map, "--out", special],
        "images": ["map", "images", material.map, "--out", special],
        "watch": ["query", material.map, "--watch", special],
        "matches": ["eval", special, "--truth", material.truth],
        "eval_truth": ["eval", material.run, "--truth", special],
        "compare": ["compare", material.run, special, "--truth", material.truth],
        "reported": ["report", special], "page": ["report", material.run, "--out", special],
        "town": ["demo", *TINY, "--write-images", special],
    }


def within_a_folder(case, kind):
    """The special file is one of those that a folder or list names."""
    name = case.random.choice(["000003.png", "run.json", "loops.csv", "evidence.db", "list"])
    folder = case.folder / "within"
    if name == "000003.png":
        folder.mkdir()
        for number in range(3):
            shutil.copy(case.material.images / f"00000{number}.png", folder)
        command = ["run", folder, "--no-report", "--out", case.folder / "out"]
    elif name == "list":
        folder.mkdir()
        (folder / "list.txt").write_text(f"special\n{case.material.images / '000001.png'}\n")
        name = "special"
        command = ["run", folder / "list.txt", "--no-report", "--out", case.folder / "out"]
    else:
        shutil.copytree(case.material.run, folder)
        (folder / name).unlink()
        command = case.random.choice([["report", folder], ["eval", folder]])
    make_special(kind, folder / name)
    return command


@attack(10)
def special_files(case):
    """Pipes, devices, folders, sockets and broken links: an end within seconds, one error."""
    special = case.folder / "special"
    special.mkdir()
    names = [*places_of_a_file(case, special), *["within"] * 4]
    pairs = list(itertools.product(SPECIAL, names))
    random.Random(7).shuffle(pairs)
    kind, name = case.pick(pairs)
    case.about = f"{kind} as {name}"
    if name == "within":
        case.loopbit(*within_a_folder(case, kind))
        return
    # Whoever writes to a pipe waits for a reader, and a watched folder for images.
    if (kind, name) in (("pipe", "export"), ("folder", "watch")):
        return
    special = make_special(kind, special / "file")
    before = os.lstat(special).st_mode if os.path.lexists(special) else None
    command = places_of_a_file(case, special)[name]
    ran = case.loopbit(*command, names=special)
    if before and (kind != "empty" or ran.code):
        case.expect(os.path.lexists(special) and os.lstat(special).st_mode == before,
                    "the special file was replaced")


HOSTILE = {
    "nul": "000001.png\0\n", "escape": "\x1b[2J\x1b]0;title\x07.png\n", "c1": "\x9b31m.png\n",
    "lines": "missing.png\n" * 50000, "long": "x" * 3000000 + "\n", "quotes": '"a\n"b",c\n' * 20,
    "utf16": "\ufeff0\x000\x00", "percent": "%s%n%d{}{0}.png\n", "self": "list.txt\n",
    "returns": "a.png\r\rb.png\r\n", "html": "<img src=x onerror=alert(1)>.png\n",
    "device": "/dev/zero\n/dev/null\n", "dots": "../" * 9 + "etc/passwd\n", "blank": " \n\t\n",
}


@attack(3)
def hostile_lists(case):
    """Lists of images that are none."""
    path = case.folder / "list.txt"
    case.about, text = case.pick(HOSTILE.items())
    good = f"{case.material.images / '000000.png'}\n"
    path.write_bytes((text + case.random.choice(["", good])).encode())
    run = case.loopbit("run", path, "--out", case.folder / "out", codes=(0, 3), keeps=[path])
    case.expect(len(run.text.splitlines()) < 30, "floods the terminal")


MEANINGLESS = {
    "hello": b"hello world\n", "empty": b"", "blank": b"\n\n \n", "comment": b"# nothing\n",
    "negative": b"-3,-2,-1\n", "huge": b"99999999999999999999,0,0\n", "nan": b"nan,nan,nan\n",
    "nul": b"20\0,0,0\n", "too_late": b"100000,0,0\n", "future": b"1,5,9\n",
    "zeros": bytes(10000), "backwards": b"20,9,3\n",
    "rows": b"".join(b"%d,0,0\n" % i for i in range(1, 200000)),
    "words": b"query,first,last\none,two,three\n", "escape": b"\x1b[31m,0,0\n",
    "long": b"7" * 10**7,
    "utf16": "20,0,0\n".encode("utf-16"), "columns": b"1,2,3,4,5,6,7,8,9,10,11,12,13\n" * 30,
    "hexadecimal": b"0x14,0x0,0x0\n", "short_matrix": b"1 0\n0 1\n",
}
REFUSED = ("hello", "empty", "blank", "nan", "nul", "zeros", "words", "escape", "utf16", "long")


@attack(4)
def meaningless_truth(case):
    """Truth that tells nothing is refused, and whatever is taken costs seconds."""
    case.about, text = case.pick(MEANINGLESS.items())
    path = case.folder / "truth.csv"
    path.write_bytes(text)
    run = ["run", case.material.images, "--limit", 3, "--no-report", "--out", case.folder / "out"]
    command = case.random.choice([["eval", case.material.run, "--truth", path],
                                  [*run, "--truth", path], [*run, "--poses", path]])
    codes = (2, 3) if case.about in REFUSED else (0, 2, 3)
    case.loopbit(*command, codes=codes, keeps=[path], names=path)


PAYLOAD = "<img src=x onerror=alert(1)>"
NAMES = [f"{PAYLOAD}.png".encode(), b"</script><script>alert(1)<script>.png".replace(b"/", b"\\"),
         b"\x1b[31mred.png", b"two\nlines.png", b'"quoted", and more.png', b"\xff\xfe\x9b.png",
         "\u202egnp.png".encode(), b"%s%n.png", b"x" * 250 + b".png", b"-rf.png", b"'; --.png",
         b"\x07\x08\x7f.png", b"tab\tand\rreturn.png", b"&amp;&lt;.png", b"= 1 + 1.png"]


@attack(4)
def hostile_names(case):
    """Images, folders and maps have names with escape sequences, new lines and HTML."""
    name = case.pick(NAMES)
    case.about = repr(name)
    folder = os.path.join(os.fsencode(case.folder), name[:-4])
    os.mkdir(folder)
    for number, image in enumerate(sorted(case.material.images.iterdir())[:14]):
        shutil.copy(image, os.path.join(folder, b"%02d" % number + name[-240:]))
    with open(os.path.join(folder, b"99" + name[-240:]), "wb"):
        pass  # is no image, and has to be named
    out, path = folder[:200] + b"_out", folder[:200] + b".db"
    ran = case.loopbit("run", os.fsdecode(folder), "--out", os.fsdecode(out), "--map",
                       os.fsdecode(path), codes=(0,))
    if ran.code:
        return
    decided_alike(case, os.fsdecode(out), decisions(case.material.run)[:14]
                  + rows_of_unreadable(os.fsdecode(out)), "hostile names")
    with open(os.path.join(out, b"report.html"), encoding="utf-8") as page:
        case.expect(PAYLOAD not in page.read(), "the name stands in the page as HTML")
    for command in (["map", "info"], ["map", "list"], ["map", "list", "--json"],
                    ["map", "export", "--format", "json"]):
        told = case.loopbit(*command, os.fsdecode(path), codes=(0,))
        if "json" in command[-1]:
            json.loads(told.out)
    asked = case.loopbit("query", os.fsdecode(path), os.fsdecode(folder), "--json", codes=(0,))
    case.expect(all(json.loads(line) for line in asked.out.splitlines()), "no JSON")


def rows_of_unreadable(folder):
    return [row for row in decisions(pathlib.Path(folder)) if row["status"] == "unreadable"]


def huge_images():
    sizes = [(30000, 30000), (65535, 65535), (2**31 - 1, 2**31 - 1), (1, 2**30), (2**20, 2**10),
             (60000, 20000)]
    images = [(f"{w}x{h}.png", png(w, h, bytes(h * (w // 8 + 1)) if w * h < 2**31 else b"",
                                   depth=1)) for w, h in sizes]
    for w, h in sizes:
        images += [(f"{w}x{h}.pgm", b"P5\n%d %d\n255\n" % (w, h)),
                   (f"{w}x{h}.bmp", struct.pack("<2sIHHIIIIHHIIIIII", b"BM", 0, 0, 0, 54, 40, w, h,
                                                1, 24, 0, 0, 0, 0, 0, 0))]
    return images


@attack(3)
def huge_pictures(case):
    """A small file says that it has billions of pixels: memory stays bounded."""
    case.about, data = case.pick(huge_images())
    folder = case.folder / "images"
    folder.mkdir()
    image = folder / case.about
    image.write_bytes(data)
    command = case.random.choice([["query", case.material.map, image],
                                  ["eval", case.material.run, "--truth", image],
                                  ["run", folder, "--no-report", "--out", case.folder / "out"]])
    case.loopbit(*command, codes=(0, 3), names=image)


POSES = {
    "equal": lambda i: (0, 0), "two_places": lambda i: (i % 2 * 100, 0),
    "line": lambda i: (i * 0.001, 0), "circle": lambda i: (i % 100, i // 100 % 100),
    "not_finite": lambda i: ("nan", "inf"), "far": lambda i: (f"{i}e300", "-1e308"),
}


@attack(1)
def many_poses(case):
    """A hundred thousand poses, all of one place: seconds, not a square of their number."""
    case.about, position = case.pick(POSES.items())
    truth, matches = case.folder / "poses.txt", case.folder / "matches.csv"
    truth.write_text("".join("1 0 0 {} 0 1 0 0 0 0 1 {}\n".format(*position(i))
                             for i in range(100000)))
    matches.write_text("query,match,score\n" + "".join(f"{i},{i - 500},1\n"
                                                       for i in range(600, 99000, 7)))
    command = case.random.choice([["eval", matches, "--truth", truth], [
        "run", case.material.images, "--limit", 2, "--no-report", "--out", case.folder / "out",
        "--truth", truth]])
    ran = case.loopbit(*command, codes=(0, 3), names=truth)
    case.expect(ran.cpu_seconds < 10, f"takes {ran.cpu_seconds:.0f} s")


PYTHON_ARRAYS = """
import random, sys, numpy as np, loopbit
r = random.Random(int(sys.argv[1]))
detector, index = loopbit.LoopDetector(), 0
def array():
    dimensions = r.choice([0, 1, 2, 2, 2, 3, 4])
    shape = [r.choice([0, 1, 3, 4, 31, 64, 240, 70000]) for _ in range(dimensions)]
    while np.prod([float(s) for s in shape]) > 1e7: shape[r.randrange(len(shape))] = 1
    type = r.choice(["u1"] * 4 + ["i1", "f4", "f8", "u2", ">u2", "c8", "O", "?", "U3", "M8[s]"])
    made = np.full(shape, r.randrange(2), "u1").astype(type)
    if type in ("f4", "f8") and made.size: made.flat[0] = r.choice([np.nan, np.inf, -1e30])
    if r.random() < 0.3: made = made[..., ::-1] if made.ndim else made
    if r.random() < 0.3: made = np.asfortranarray(made)
    if r.random() < 0.2 and made.ndim == 2 and len(made):
        rows = min(70000, 10**7 // max(1, made.shape[1]))
        made = np.broadcast_to(made[:1], (rows, *made.shape[1:]))
    return made
times = (None, 1.5, float("nan"), float("inf"), -1e308, 10**400, "soon")
calls = (lambda: detector.process(array(), r.choice(times)), lambda: detector.query(array()),
         lambda: loopbit.binary_content(array()), lambda: loopbit.extract_surf(array()),
         lambda: loopbit.saliency_map(array()), lambda: loopbit.MatchList(array(), array()),
         lambda: loopbit.similarity_matrix([array()]), lambda: loopbit.read_truth(array()),
         lambda: loopbit.set_option(loopbit.LoopDetectorOptions(), "surf.max_keypoints", array()))
for _ in range(60):
    try: r.choice(calls)()
    except (loopbit.Error, TypeError, ValueError, OverflowError): pass
"""


@attack(2)
def python_arrays(case):
    """Arrays of all types, shapes and strides."""
    ran = case.finish(python(case, PYTHON_ARRAYS, case.random.randrange(10**9)))
    case.expect(ran.code == 0 and not ran.err, f"{ran.code} {ran.text[-600:]}")
    case.expect(ran.memory_mib < 2048, f"{ran.memory_mib:.0f} MiB")


WORDS = ("run", "query", "map", "eval", "compare", "report", "options", "info", "list", "check",
         "merge", "compact", "--out", "--map", "--truth", "--limit", "--every", "--set",
         "--config", "--threads", "--json", "--drop", "--budget", "--places", "--protocol",
         "--preset", "--overwrite", "--no-report", "--help", "--", "-", "", " ", "\n", "\x1b[31m",
         "-1", "nan", "1e999", "99999999999999999999", "surf.max_keypoints=0", "=", "x" * 5000,
         "\udcff", "camera:999", "camera:-1", "camera:", "%s", "kitti", "--limit=", "--set==")


@attack(6)
def arguments(case):
    """Words of the command line in any order."""
    material = case.material
    words = [*WORDS, *[material.images, material.map, material.run, material.truth,
                       case.folder / "out"] * 4]
    command = [case.random.choice(WORDS[:11]),
               *case.random.choices(words, k=case.random.randrange(7))]
    case.loopbit(*command, keeps=[material.map, material.run, material.truth])
