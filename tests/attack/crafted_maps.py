# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Attacks by maps that somebody made on purpose, not by accident."""

import shutil
import sqlite3
import struct
import zlib

from damaged_files import use_map
from harness import attack

MAX = 2**63 - 1
STATEMENTS = {
    "view": "ALTER TABLE place RENAME TO p; CREATE VIEW place AS SELECT * FROM p",
    "endless_view": "DROP TABLE loop; CREATE VIEW loop AS WITH RECURSIVE n(i) AS (SELECT 1 UNION "
                    "ALL SELECT i + 1 FROM n) SELECT i AS loop, 1 AS session, 1 AS frame, 1 AS "
                    "match_session, 0 AS match_frame, 1.0 AS score, 1.0 AS similarity, 9 AS "
                    "matches, 9 AS inliers, 0 AS checksum FROM n",
    "trigger": "CREATE TRIGGER t AFTER INSERT ON session BEGIN DELETE FROM place; END",
    "table": "CREATE TABLE other (x)", "no_table": "DROP TABLE features",
    "index": "CREATE INDEX i ON place (abs(frame))",
    "generated": "ALTER TABLE place ADD COLUMN g INTEGER GENERATED ALWAYS AS (frame * 2) VIRTUAL",
    "column": "ALTER TABLE session RENAME COLUMN uid TO name2",
    "version": "PRAGMA user_version = 99", "negative_version": "PRAGMA user_version = -1",
    "version_0": "PRAGMA user_version = 0", "version_1": "PRAGMA user_version = 1",
    "no_application": "PRAGMA application_id = 0",
    "huge_blob": "UPDATE features SET features = zeroblob(60000000) WHERE place = 1",
    "text_content": "UPDATE place SET content = 'text' WHERE place = 2",
    "short_content": "UPDATE place SET content = x'00' WHERE place = 2",
    "real_frame": "UPDATE place SET frame = 2.5 WHERE place = 2",
    "infinite_time": "UPDATE place SET timestamp = 9e999",
    "text_time": "UPDATE place SET timestamp = 'nan' WHERE place = 3",
    "negative_frame": "UPDATE place SET frame = -5 WHERE place = 1",
    "huge_frame": f"UPDATE place SET frame = {MAX} WHERE place = 1",
    "twice": "UPDATE place SET frame = 1 WHERE place = 1",
    "no_session": "UPDATE place SET session = 77 WHERE place = 1",
    "huge_session": f"UPDATE session SET session = {MAX} WHERE session = 2",
    "last_key": f"UPDATE sqlite_sequence SET seq = {MAX}",
    "text_key": "UPDATE sqlite_sequence SET seq = 'many'",
    "negative_frames": "UPDATE session SET frames = -1",
    "huge_frames": f"UPDATE session SET frames = {MAX}",
    "same_uid": "UPDATE session SET uid = '" + "0" * 32 + "'",
    "long_name": "UPDATE session SET name = printf('%.*c', 1000000, 'x')",
    "control_name": "UPDATE session SET name = char(27) || '[31m' || char(10) || char(155, 0, 7)",
    "nul_uid": "UPDATE session SET uid = 'a' || char(0) || 'b' WHERE session = 1",
    "blob_name": "UPDATE session SET name = x'ff00fe'",
    "no_options": "UPDATE session SET options = '{'",
    "deep_options": "UPDATE session SET options = printf('%.*c', 100000, '[')",
    "senseless_options": "UPDATE session SET options = '{\"surf\": {\"max_keypoints\": 1e300}}'",
    "infinite_score": "UPDATE loop SET score = -9e999, similarity = 9e999",
    "text_score": "UPDATE loop SET score = 'nan'",
    "loop_to_nowhere": "UPDATE loop SET match_session = 99, match_frame = -1",
    "loop_to_itself": "UPDATE loop SET match_session = session, match_frame = frame",
    "unlinked": "DELETE FROM linked",
    "far_frames": "DELETE FROM linked; UPDATE place SET frame = frame + 2147483000",
    "linked_to_nowhere": "UPDATE linked SET session = session + 70",
    "rejected_anew": "DELETE FROM linked; INSERT INTO rejected SELECT * FROM loop",
    "text_image": "UPDATE image SET image = 'no jpeg'",
    "small_pages": "PRAGMA journal_mode = DELETE; PRAGMA page_size = 512; VACUUM",
    "other_journal": "PRAGMA journal_mode = DELETE",
}
FEATURES = {"negative_size": (-1, 240, 0, 1), "negative_number": (320, 240, 0, -1),
            "huge_number": (320, 240, 0, 2**31 - 1), "dark_above": (320, 240, 5, 1),
            "no_area": (0, 0, 0, 0), "nan_place": (320, 240, 0, 1)}


def crc(*values):
    packed = [v if isinstance(v, bytes) else v.encode() if isinstance(v, str) else
              struct.pack("<d", v or 0.0) if v is None or isinstance(v, float) else
              struct.pack("<q", v) for v in values]
    return zlib.crc32(b"".join(packed))


def sign(database):
    """Gives every row the checksum of what it holds now, as docs/format.md says."""
    database.create_function("crc", -1, crc)
    values = {"session": "session, frames, uid, name, started, loopbit, options",
              "place": "session, frame, timestamp, content",
              "loop": "session, frame, match_session, match_frame, score, similarity, matches, "
                      "inliers",
              "rejected": "match_session, match_frame, session, frame, score, similarity, matches, "
                          "inliers",
              "linked": "session"}
    for table, names in values.items():
        database.execute(f"UPDATE {table} SET checksum = crc({names})")
    for table, names in {"features": "p.session, p.frame, features",
                         "image": "image, p.session, p.frame"}.items():
        database.execute(f"UPDATE {table} SET checksum = crc({names}) FROM place AS p "
                         f"WHERE p.place = {table}.place")


@attack(10)
def crafted_map(case):
    """Statements of SQL change the map; every second time it is signed anew where it can be."""
    path = case.folder / "crafted.db"
    shutil.copy(case.material.map, path)
    names = [*STATEMENTS, *FEATURES]
    name = names[case.number // 2 % len(names)]
    signed = case.number % 2 == 1
    database = sqlite3.connect(path)
    database.executescript("PRAGMA writable_schema = ON; PRAGMA ignore_check_constraints = ON")
    if name in FEATURES:
        blob = struct.pack("<4i", *FEATURES[name]) + struct.pack("<4f", *[float("nan")] * 4)
        database.execute("UPDATE features SET features = ?", [blob + bytes(64)])
    else:
        database.executescript(STATEMENTS[name])
    if signed:
        try:
            sign(database)
        except sqlite3.Error:  # there is no such row any more
            signed = False
    database.commit()
    database.close()
    case.about = f"{name}{', signed' if signed else ''}"
    use_map(case, path, signed)


@attack(3)
def cyclic_pages(case):
    """Pages that lead to themselves, and a list of free pages without an end."""
    path = case.folder / "cyclic.db"
    data = bytearray(case.material.map.read_bytes())
    size = struct.unpack(">H", data[16:18])[0]
    pages = [p for p in range(1, len(data) // size) if data[p * size] == 5]
    if pages and case.number % 2:
        page = case.random.choice(pages)
        data[page * size + 8:page * size + 12] = struct.pack(">I", page + 1)
    else:
        trunk = case.random.randrange(2, len(data) // size)
        data[32:40] = struct.pack(">II", trunk, 1000)
        data[(trunk - 1) * size:(trunk - 1) * size + 8] = struct.pack(">II", trunk, 2**31)
    path.write_bytes(data)
    use_map(case, path)
