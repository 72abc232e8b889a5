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

# expect CODE WHY COMMAND...: the exit code of a test that reads $inputs.
inputs=("$scratch/file")
stamp=$scratch/passed/stamp
expect() {
  local code=0
  "$script" "$stamp" "${inputs[@]}" -- "${@:3}" >/dev/null || code=$?
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

# Folders, patterns and names.
stamp=$scratch/passed/
mkdir -p "$scratch/tree/below"
inputs=("$scratch/tree" names:"$scratch/data" "$scratch/**/*.txt" makes:"$scratch/made")
echo one | tee "$scratch/tree/below/one" >"$scratch/file.txt"
expect 0 "first" touch "$scratch/made"
expect 77 "unchanged" touch "$scratch/made"
expect 0 "a second command" true
expect 77 "the second command again" true
rm "$scratch/made"
expect 0 "what it makes is gone" touch "$scratch/made"
echo two >"$scratch/tree/below/one"
expect 0 "a file of a folder" true
echo two >"$scratch/file.txt"
expect 0 "a file that a pattern names" true
mv "$scratch/tree/below/one" "$scratch/tree/below/two"
expect 0 "another name in a folder" true
unset LOOPBIT_DATA
expect 0 "no data" true
echo 22 >"$scratch/data/image"
expect 77 "the content where only names matter" true
touch "$scratch/data/more"
expect 0 "another name where only names matter" true
inputs=("$scratch/none")
expect 1 "an input that does not exist" true 2>/dev/null

# A program counts without its debug information, and so does a library.
build() {
  g++ -g -c -x c++ -o "$scratch/object" - -ffile-prefix-map="$scratch"= <<<"$1"
  g++ -o "$scratch/program" "$scratch/object"
  rm -f "$scratch/library.a"
  ar rcs "$scratch/library.a" "$scratch/object"
}
for built in program library.a; do
  inputs=("$scratch/$built")
  build 'int main() { return 1; }'
  expect 0 "$built, first" true
  build $'// A comment.\nint main() { return 1; }'
  expect 77 "$built, one more comment" true
  build 'int main() { return 2; }'
  expect 0 "$built, another constant" true
done
