# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Prints the loops in a sequence of images: find_loops.py INPUT"""
import sys

import loopbit


def show(found):
    if found.is_loop:
        print(f"{found.frame} is {found.match}, score {found.score:g}")


# An unusable frame is reported, counted and skipped.
loopbit.run(sys.argv[1], on_detection=show,
            on_bad_frame=lambda message: print(message, file=sys.stderr))
