# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Prints the loops in a sequence of images: find_loops.py INPUT"""
import sys

import loopbit


def show(found):
    if found.is_loop:
        print(f"{found.frame} is {found.match}, score {found.score:g}")


# A frame that cannot be used is told, counted, and passed over.
loopbit.run(sys.argv[1], on_detection=show, on_bad_frame=lambda told: print(told, file=sys.stderr))
