#!/usr/bin/env bash
# Proves the package from outside: installs a build, then builds and runs a program against it.
#
#   run.sh BUILD_DIR SCRATCH    leaves the installed package in SCRATCH/prefix
set -euo pipefail

build=$1
scratch=$2
source=$(dirname "$(readlink -f "$0")")

rm -rf "$scratch"
mkdir -p "$scratch"
cmake --install "$build" --prefix "$scratch/prefix" >"$scratch/install.log"
cmake -S "$source" -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix"
cmake --build "$scratch/build"

for image in first second; do
  { printf 'P5\n320 240\n255\n' && head -c 76800 <(seq 100000); } >"$scratch/$image.pgm"
done
"$scratch/build/consumer" "$scratch/first.pgm" "$scratch/second.pgm"
