# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Loop matrices as the tests need them."""

import struct


def write_mat(path, name, size, cells, with_string=False):
    """A MAT-file of version 5 with one dense matrix of bytes, `cells` of which are 1, perhaps after
    a string."""
    def element(kind, data):
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    dense = bytearray(size * size)
    for row, column in cells:
        dense[column * size + row] = 1
    matrix = (element(6, struct.pack("<II", 9, 0)) + element(5, struct.pack("<ii", size, size))
              + element(1, name.encode()) + element(2, bytes(dense)))
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    handle = (element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1))
              + element(1, b"") + element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1)))
    string = (element(6, struct.pack("<II", 17, 0)) + element(1, b"s") + element(1, b"MCOS")
              + element(1, b"string") + element(14, handle))
    others = element(14, string) if with_string else b""
    path.write_bytes(header + others + element(14, matrix))
