#!/usr/bin/env bash
# run.sh LOOPBIT: tests the report page in a headless Chromium, on pages that LOOPBIT makes and on
# made-up data. Needs the packages that scripts/page installs.
set -euo pipefail

loopbit=$1
here=$(dirname "$(readlink -f "$0")")
root=$(dirname "$(dirname "$here")")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# What the command says matters only if it fails.
loopbit() {
  "$loopbit" "$@" >"$scratch/said" 2>&1 || {
    cat "$scratch/said"
    exit 1
  }
}

town=(--world spacing_m=1.5 --world width_px=320 --world height_px=240)
world=(--frames 150 --world laps=2 "${town[@]}")
loopbit demo "${world[@]}" --out "$scratch/demo"
loopbit demo "${world[@]}" --set decision.min_score=0.999999 --out "$scratch/strict"
loopbit demo --frames 75 --world laps=1 "${town[@]}" --map "$scratch/town.db" --out "$scratch/first"
loopbit demo "${world[@]}" --map "$scratch/town.db" --out "$scratch/second"
# The second lap is in wider images.
loopbit demo "${world[@]}" --write-images "$scratch/town"
loopbit demo "${world[@]}" --world height_px=180 --write-images "$scratch/wide"
{
  seq -f "$scratch/town/images/%06g.png" 0 74
  seq -f "$scratch/wide/images/%06g.png" 75 149
} >"$scratch/mixed.txt"
loopbit run "$scratch/mixed.txt" --out "$scratch/mixed"
loopbit run "$scratch/town" --odometry "$scratch/town/odometry.txt" --correct --no-poses --out "$scratch/corrected" \
  --poses "$scratch/town/poses.txt"
printf 'query,match,score\n120,45,0.9\n121,10,0.7\n' >"$scratch/other.csv"
loopbit compare "$scratch/demo" "$scratch/strict" "other=$scratch/other.csv" \
  --out "$scratch/compared.html"

printf 'query,match,score\n' >"$scratch/none.csv"
printf 'query,match\n' >"$scratch/no_revisit.csv"
loopbit compare "one=$scratch/none.csv" "another=$scratch/none.csv" \
  --truth "$scratch/no_revisit.csv" --out "$scratch/no_frames.html"

node "$here/report_test.mjs" --playwright "$root/build/page/node_modules" --page "$root/src/report/report.html" \
  --report "$scratch/demo/report.html" --run-json "$scratch/demo/run.json" \
  --brief "$scratch/second/report.html" --run-json "$scratch/second/run.json" \
  --report "$scratch/mixed/report.html" --run-json "$scratch/mixed/run.json" \
  --brief "$scratch/corrected/report.html" --run-json "$scratch/corrected/run.json" \
  --exports "$scratch" --brief "$scratch/compared.html" --opens "$scratch/no_frames.html"

# What a person judged is truth for the command.
loopbit eval "$scratch/demo" --truth "$scratch/truth.csv" --not-false "$scratch/not_false.csv"
