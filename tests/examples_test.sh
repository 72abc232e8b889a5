#!/usr/bin/env bash
# Builds the examples against the loopbit installed in PREFIX, and runs them on the built-in world.
#
#   examples_test.sh PYTHON PREFIX CONFIGURED SCRATCH
#
# CONFIGURED: the build of another program against PREFIX
set -euo pipefail

python=$1
prefix=$2
configured=$3
scratch=$4
examples=$(dirname "$(dirname "$(readlink -f "$0")")")/examples
export PYTHONPATH=$prefix/lib/python3/dist-packages PYTHONDONTWRITEBYTECODE=1

rm -rf "$scratch"
mkdir -p "$scratch"
"$prefix/bin/loopbit" demo --frames 150 --world spacing_m=1.5 --world laps=2 --world width_px=320 \
  --world height_px=240 --write-images "$scratch/town" 2>"$scratch/progress"

"$examples/../tests/configure_again" "$configured" "$examples" "$scratch/build"
cmake --build "$scratch/build"
"$scratch/build/keyframe_slam" "$scratch/town/images" | tee "$scratch/edges"
grep -q '^edge [0-9]* -> [0-9]*, score' "$scratch/edges"

# Odometry that is exact: most loops become edges with a length, and a turn of a few degrees.
"$scratch/build/odometry_edges" "$scratch/town/images" "$scratch/town/poses.txt" \
  "$scratch/town/camera.yaml" >"$scratch/measured_edges"
(($(grep -c '^EDGE_SE3:QUAT [0-9]* [0-9]* ' "$scratch/measured_edges") >= 10))
[[ $(awk '{ print NF }' "$scratch/measured_edges" | sort -u) == 31 ]]

# Of two loops the wrong one is found out, and the drift is taken back.
(cd "$scratch" && build/correct_trajectory) | tee "$scratch/corrected"
grep -qx 'loop 45 -> 5: kept' "$scratch/corrected"
grep -qxE 'loop 65 -> 5: (unreachable|inconsistent|outlier)' "$scratch/corrected"
[[ $(grep -c '^EDGE_SE3:QUAT' "$scratch/corrected.g2o") == 81 ]]

# An image that is too small and one that is none change no other frame's number.
cp -r "$scratch/town/images" "$scratch/odd"
{ printf 'P5\n16 16\n255\n' && head -c 256 <(seq 100); } >"$scratch/odd/000003.png"
echo "no image" >"$scratch/odd/000004.png"
"$scratch/build/keyframe_slam" "$scratch/odd" >"$scratch/odd_edges"
without_scores() { cut -d, -f1 "$1" | sort; }
(($(comm -12 <(without_scores "$scratch/edges") <(without_scores "$scratch/odd_edges") | wc -l) >= 10))

"$python" "$examples/find_loops.py" "$scratch/odd" | tee "$scratch/loops"
"$prefix/bin/loopbit" run "$scratch/odd" --out "$scratch/run" --no-report 2>"$scratch/progress"
# As many as the command finds, at once and late.
cut -d, -f1-4 "$scratch"/run/{loops,late_loops}.csv >"$scratch/all"
[[ $(wc -l <"$scratch/loops") == $(grep -cE ',(loop|late|withdrawn),' "$scratch/all") ]]

"$python" "$examples/paper_figures.py" "$scratch/town/images" "$scratch/town/truth.csv" \
  "$scratch/figures" "$scratch/town/poses.txt"
for name in precision_recall times similarity trajectory; do
  [[ $(head -c 4 "$scratch/figures/$name.pdf") == %PDF ]]
done
test -s "$scratch/figures/report.html"

# The notebook prints what is committed with it, and draws figures.
mkdir "$scratch/notebook"
cp "$examples/first_steps.ipynb" "$scratch/notebook"
PATH=$prefix/bin:$PATH PYDEVD_DISABLE_FILE_VALIDATION=1 "$python" -m nbconvert --log-level=WARN --to notebook \
  --execute --inplace --ExecutePreprocessor.record_timing=False "$scratch/notebook/first_steps.ipynb"
"$python" - "$examples/first_steps.ipynb" "$scratch/notebook/first_steps.ipynb" <<'END'
import json
import sys


def outputs(notebook):
    with open(notebook) as file:
        cells = json.load(file)["cells"]
    return [[output.get("text") or sorted(output["data"]) for output in cell.get("outputs", [])] for cell in cells]


committed, executed = map(outputs, sys.argv[1:])
assert committed == executed, f"{executed}; if this is right, copy {sys.argv[2]} to examples/"
assert sum("image/png" in output for cell in executed for output in cell) == 2
END

# The first lap is the map, and every tenth image of the second asks it.
"$prefix/bin/loopbit" run "$scratch/town/images" --map "$scratch/town.db" --limit 75 --no-report \
  2>"$scratch/progress"
mkdir "$scratch/second_lap"
cp "$scratch"/town/images/000{08,09,10,11,12,13,14}0.png "$scratch/second_lap"
"$scratch/build/relocalise" "$scratch/town.db" "$scratch/second_lap" | tee "$scratch/places"
"$python" "$examples/relocalise.py" "$scratch/town.db" "$scratch/second_lap" | cmp - "$scratch/places"
# An image that is too small ends both, with one sentence.
for relocalise in "$scratch/build/relocalise" "$python $examples/relocalise.py"; do
  code=0
  $relocalise "$scratch/town.db" "$scratch/odd" >"$scratch/places_before" 2>"$scratch/error" || code=$?
  [[ $code == 1 && $(wc -l <"$scratch/places_before") == 3 ]]
  [[ $(cat "$scratch/error") == *" 16 x 16 "*. && $(wc -l <"$scratch/error") == 1 ]]
done
asked=$("$prefix/bin/loopbit" query "$scratch/town.db" "$scratch/second_lap" --places 1)
[[ $(grep -c ' is frame [0-9]* of session 1, score' "$scratch/places") == $(grep -c ' loop ' <<<"$asked") ]]
