# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""What is attacked: images of several formats, a video, runs, maps and the files around them."""

import pathlib
import shutil
import sqlite3
import struct
import sys
import time
import zlib

from harness import LOOPBIT, decisions
from served_command import run_command

FRAMES = 24
WIDTH, HEIGHT = 320, 240
# A drive that is quickly drawn.
TINY = ["--frames", 6, "--world", "laps=1", "--world", "spacing_m=19", "--world", "width_px=64",
        "--world", "height_px=64"]
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
CORPUS = REPOSITORY / "fuzz" / "corpus"


class Material:
    """Made once, by the command itself; tries copy from it."""

    def __init__(self, map_crash, module, folder):
        self.map_crash, self.module = map_crash, module
        self.folder = folder
        folder.mkdir()
        self.town = folder / "town"
        self.images = self.town / "images"
        self.truth = self.town / "truth.csv"
        self.run = folder / "run"
        self.map = folder / "map.db"  # two sessions, with images
        self.other_map = folder / "other.db"
        self.video = folder / "video.avi"
        self.formats = folder / "formats"

    def command(self, *arguments):
        run_command(LOOPBIT, *arguments).check_returncode()

    def make(self):
        self.command("demo", "--write-images", self.town, "--frames", FRAMES, "--world", "laps=2",
                     "--world", f"spacing_m={225 / FRAMES}", "--world", f"width_px={WIDTH}",
                     "--world", f"height_px={HEIGHT}")
        self.command("run", self.images, "--out", self.run, "--truth", self.truth)
        first = self.folder / "first"
        self.command("run", self.images, "--out", first, "--map", self.map, "--keep-images",
                     "--limit", FRAMES // 2, "--no-report")
        self.command("run", self.images, "--out", first, "--map", self.map, "--overwrite",
                     "--every", 2, "--no-report")
        self.command("run", self.images, "--out", first, "--map", self.other_map, "--overwrite",
                     "--limit", 5, "--no-report")
        self.run_with_a_map()
        self.command("map", "images", self.map, "--out", self.folder / "pictures")
        self.make_images()
        write_video(self.video, [p.read_bytes() for p in
                                 sorted((self.folder / "pictures").iterdir())[:8]])
        return self

    def run_with_a_map(self):
        """What a run that continues the map decides, and the seconds that it takes."""
        copy = shutil.copy(self.map, self.folder / "copy.db")
        begun = time.monotonic()
        self.command("run", self.images, "--out", self.folder / "mapped", "--map", copy)
        self.run_seconds = time.monotonic() - begun
        self.mapped = decisions(self.folder / "mapped")

    def make_images(self):
        """The same picture as PNG, JPEG, BMP, PGM and TIFF."""
        self.formats.mkdir()
        pixels = bytes((x * y // 7 + 40 * (x // 16 + y // 16)) % 256
                       for y in range(HEIGHT) for x in range(WIDTH))
        shutil.copy(self.images / "000000.png", self.formats / "image.png")
        shutil.copy(sorted((self.folder / "pictures").iterdir())[0], self.formats / "image.jpg")
        (self.formats / "image.pgm").write_bytes(b"P5\n%d %d\n255\n" % (WIDTH, HEIGHT) + pixels)
        grey = b"".join(bytes((i, i, i, 0)) for i in range(256))
        (self.formats / "image.bmp").write_bytes(
            struct.pack("<2sIHHIIiiHHIIiiII", b"BM", 1078 + len(pixels), 0, 0, 1078, 40, WIDTH,
                        HEIGHT, 1, 8, 0, len(pixels), 2835, 2835, 256, 0) + grey + pixels)
        tags = [(256, WIDTH), (257, HEIGHT), (258, 8), (259, 1), (262, 1), (273, 122), (277, 1),
                (278, HEIGHT), (279, len(pixels))]
        (self.formats / "image.tif").write_bytes(
            struct.pack("<2sHIH", b"II", 42, 8, len(tags))
            + b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
            + bytes(4) + pixels)

    def text_files(self):
        """Files that readers take, by kind: several of each."""
        kinds = {"truth": [self.truth, self.town / "not_false.csv", *CORPUS.glob("truth/*")],
                 "poses": [self.town / "poses.txt", *CORPUS.glob("poses/*")],
                 "mat": CORPUS.glob("mat/*"), "config": CORPUS.glob("options/*"),
                 "matches": [*CORPUS.glob("match_list/*"), *CORPUS.glob("loops/*")]}
        return {kind: sorted(files) for kind, files in kinds.items()}


def png(width, height, data=b"", depth=8, colour=0):
    """A PNG that says it is so large, whatever its data are."""
    def chunk(kind, body):
        return (struct.pack(">I", len(body)) + kind + body
                + struct.pack(">I", zlib.crc32(kind + body)))
    return (b"\x89PNG\r\n\x1a\n"
            + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b""))


def write_video(path, jpegs):
    """Motion JPEG in AVI, ten frames a second."""
    width, height = jpeg_size(jpegs[0])

    def chunk(kind, body):
        return kind + struct.pack("<I", len(body)) + body + bytes(len(body) % 2)

    main = struct.pack("<14I", 100000, 0, 0, 16, len(jpegs), 0, 1, 0, width, height, 0, 0, 0, 0)
    stream = struct.pack("<4s4sIHHIIIIIIIIhhhh", b"vids", b"MJPG", 0, 0, 0, 0, 1, 10, 0,
                         len(jpegs), 0, 0, 0, 0, 0, width, height)
    bitmap = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 24, b"MJPG", width * height * 3,
                         0, 0, 0, 0)
    header = chunk(b"LIST", b"hdrl" + chunk(b"avih", main) + chunk(
        b"LIST", b"strl" + chunk(b"strh", stream) + chunk(b"strf", bitmap)))
    movie, index, offset = b"movi", b"", 4
    for jpeg in jpegs:
        index += struct.pack("<4sIII", b"00dc", 16, offset, len(jpeg))
        movie += chunk(b"00dc", jpeg)
        offset = len(movie)
    path.write_bytes(chunk(b"RIFF", b"AVI " + header + chunk(b"LIST", movie)
                           + chunk(b"idx1", index)))


def jpeg_size(data):
    """Width and height, from the frame header."""
    at = 2
    while data[at + 1] not in (0xC0, 0xC2):
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    height, width = struct.unpack(">HH", data[at + 5:at + 9])
    return width, height


def damaged(data, random):
    """Data with flipped bits, a run of other bytes, a cut, a part doubled, or a number changed."""
    data = bytearray(data)
    size = len(data)
    if size == 0:
        return bytes([random.randrange(256)])
    at = random.randrange(min(size, random.choice([64, 1024, size])))
    length = random.randint(1, min(size - at, 512))
    kind = random.randrange(6)
    if kind == 0:
        for _ in range(random.choice([1, 4, 64])):
            data[random.randrange(size)] ^= 1 << random.randrange(8)
    elif kind == 1:
        data[at:at + length] = random.choice([bytes(length), b"\xff" * length,
                                              random.randbytes(length)])
    elif kind == 2:
        del data[random.choice([at, random.randrange(size)]):]
    elif kind == 3:
        del data[at:at + length]
    elif kind == 4:
        data[at:at] = data[at:at + length] * random.choice([1, 2, 100])
    else:
        data[at:at + 4] = random.choice([b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\0\x80",
                                         b"-1e9", b"nan,", b"\n\0\n\0"])
    return bytes(data)


def map_rows(path, by_uid=True):
    """The places of a map by uid, or number, of the session, and by frame."""
    database = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        column = "uid" if by_uid else "session"
        uid = dict(database.execute(f"SELECT session, {column} FROM session"))
        features = dict(database.execute("SELECT place, features FROM features"))
        return {(uid[s], f): (t, c, features.get(p)) for p, s, f, t, c in database.execute(
            "SELECT place, session, frame, timestamp, content FROM place") if s in uid}
    finally:
        database.close()


def python(case, script, *arguments, **options):
    """Begins a program that has the Python module, as Try.start() does."""
    return case.start("-c", script, *arguments, program=sys.executable,
                      environment={"PYTHONPATH": str(case.material.module),
                                   "PYTHONDONTWRITEBYTECODE": "1"}, **options)
