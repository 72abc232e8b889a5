#!/usr/bin/env bash
# ros2_node_test.sh NODE LOOPBIT: the node of examples/ros2, with the stand-in for ROS, finds the loops that
# the command finds, also late.
set -euo pipefail

node=$1
loopbit=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

"$loopbit" demo --frames 75 --world laps=2 --world spacing_m=3 --world width_px=320 --world height_px=240 \
  --write-images "$scratch/town" --quiet
# The stand-in leaves out the second image, too.
: >"$scratch/town/images/000001.png"
"$loopbit" run "$scratch/town/images" --out "$scratch/run" --no-report --quiet
{
  grep ',loop,' "$scratch/run/loops.csv" | cut -d, -f3,1,4 | sed -E 's/^([0-9]+),loop,/loop,\1,/'
  tail -n +2 "$scratch/run/late_loops.csv" | sed -E 's/^([0-9]+),(late|withdrawn),([0-9]+),.*/\2,\1,\3/'
} | sort >"$scratch/expected"
"$node" "$scratch/town/images" 2>"$scratch/warnings" >"$scratch/loops"
sed -E 's/.*"type": "(.*)", "query": ([0-9]+), "match": ([0-9]+), "query_time_s": \2\..*"match_time_s": \3\..*/\1,\2,\3/' \
  "$scratch/loops" | sort >"$scratch/found"
grep -q 'not this encoding' "$scratch/warnings"
[[ $(wc -l <"$scratch/found") -gt 10 ]]
diff "$scratch/expected" "$scratch/found"
