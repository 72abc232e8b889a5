#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
# unless_unchanged_test.sh SCRIPT: a test that passed is skipped until something that it reads changes.
set -euo pipefail

script=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir "$scratch/data"
export LOOPBIT_SKIP_UNCHANGED=1 LOOPBIT_DATA=$scratch/data

# expect CODE WHY COMMAND...: the exit code of a test that reads one file.
expect() {
  local code=0
  "$script" "$scratch/passed/stamp" "$scratch/file" -- "${@:3}" >/dev/null || code=$?
  [[ $code == "$1" ]] || { echo "$2: exit code $code, not $1" >&2 && exit 1; }
}

echo one >"$scratch/file"
expect 1 "failed" test -e "$scratch/none"
expect 1 "failed before" test -e "$scratch/none"
expect 0 "another command" true
expect 77 "unchanged" true
(unset LOOPBIT_SKIP_UNCHANGED && expect 0 "not asked to skip" true)
echo two >"$scratch/file"
expect 0 "another content" true
touch "$scratch/data/image"
expect 0 "one more image" true
echo 1 >"$scratch/data/image"
expect 0 "another image" true
LC_ALL=POSIX expect 0 "another environment" true
LC_ALL=POSIX expect 77 "the same environment" true
LC_ALL=POSIX expect 0 "an input that the test changes" sh -c "date +%N >>'$scratch/file'"
LC_ALL=POSIX expect 0 "changed by the test" sh -c "date +%N >>'$scratch/file'"
LC_ALL=POSIX expect 1 "fails after a pass" false
LC_ALL=POSIX expect 0 "passed, then failed" true
