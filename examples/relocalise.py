# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Looks up the images of a sequence in a map: relocalise.py MAP INPUT"""
import sys

import loopbit


def relocalise(path, images):
    map = loopbit.MapReader(path)
    detector = loopbit.LoopDetector(map=map)
    ranking = []
    for frame in loopbit.open_source(images):
        if frame.error:
            print(frame.error, file=sys.stderr)
            continue
        found = detector.query(frame.image, ranking=ranking)
        if found.is_loop:
            place = ranking[0].place
            print(f"{frame.name} is frame {place.frame} of session {place.session}, "
                  f"score {ranking[0].score:g}")
        else:
            print(f"{frame.name} is not recognised: {found.status.name}")
    for clause in map.damage:
        print(f"left out: {clause}", file=sys.stderr)


try:
    relocalise(sys.argv[1], sys.argv[2])
except (loopbit.Error, ValueError) as error:
    sys.exit(str(error))
