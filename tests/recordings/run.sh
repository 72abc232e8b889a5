#!/usr/bin/env bash
# run.sh PYTHON BUILD_DIR LOOPBIT [PYTEST ARGUMENTS]: reads recordings that other libraries wrote. Fetches those for
# Node.js from the network once, to BUILD_DIR/recordings.
set -euo pipefail

python=$1
packages=$2/recordings
here=$(dirname "$(readlink -f "$0")")

mkdir -p "$packages"
if ! cmp -s "$here/package-lock.json" "$packages/package-lock.json" || [[ ! -e $packages/node_modules/.package-lock.json ]]; then
  cp "$here"/package*.json "$here/.npmrc" "$packages"
  npm --prefix "$packages" ci --no-audit --no-fund --loglevel=error
fi
export LOOPBIT_COMMAND=$3 LOOPBIT_NODE_MODULES=$packages/node_modules
export PYTHONPATH=$2/python PYTHONDONTWRITEBYTECODE=1
exec "$python" -m pytest -q -p no:cacheprovider "$here" "${@:4}"
