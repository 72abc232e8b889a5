# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Prints the loops in a sequence of images: find_loops.py INPUT"""
import sys

import loopbit


def show(found):
    if found.is_loop:
        print(f"{found.frame} is {found.match}, score {found.score:g}")
    for loop in found.late_loops:  # of frames just before
        print(f"{loop.frame} is {loop.match}, score {loop.score:g}, found late")
    for loop in found.withdrawn_loops:
        print(f"{loop.frame} is not {loop.match} after all")


# An unusable frame is reported, counted and skipped.
loopbit.run(sys.argv[1], on_detection=show,
            on_bad_frame=lambda message: print(message, file=sys.stderr))
