# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Prints the loops in a sequence of images: find_loops.py INPUT"""
import sys

import loopbit

detector = loopbit.LoopDetector()
for frame in loopbit.open_source(sys.argv[1]):
    if frame.image is None:
        found = detector.skip(frame.timestamp_s)
    else:
        found = detector.process(frame.image, frame.timestamp_s)
    if found.is_loop:
        print(f"{found.frame} is {found.match}, score {found.score:g}")
