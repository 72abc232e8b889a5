#!/usr/bin/env bash
# Proves that pip installs the package from the source tree, without a network: into a virtual
# environment that sees what Debian packages. The compiled part comes from BUILD_DIR.
#
#   pip_test.sh PYTHON BUILD_DIR SCRATCH
set -euo pipefail

python=$1
build=$2
scratch=$3
root=$(dirname "$(dirname "$(dirname "$(readlink -f "$0")")")")

rm -rf "$scratch"
mkdir -p "$scratch/tree"
# A copy, for setuptools writes into the tree that it builds.
cp -r "$root"/{CMakeLists.txt,README.md,pyproject.toml,setup.py,python} "$scratch/tree"
"$python" -m venv --system-site-packages "$scratch/venv"
PIP_NO_INDEX=1 PIP_DISABLE_PIP_VERSION_CHECK=1 LOOPBIT_BUILD_DIR=$build \
  "$scratch/venv/bin/pip" install --quiet --no-build-isolation "$scratch/tree"
cd "$scratch"
version=$(sed -n 's/^  VERSION //p' "$root/CMakeLists.txt")
"$scratch/venv/bin/python" - "$version" <<'END'
import importlib.metadata
import importlib.resources
import pathlib
import sys

import loopbit

assert loopbit.__version__ == importlib.metadata.version("loopbit") == sys.argv[1]
assert "venv" in pathlib.Path(loopbit.__file__).parts, loopbit.__file__
assert {"py.typed", "_loopbit.pyi"} <= {f.name for f in importlib.resources.files(loopbit).iterdir()}
world = loopbit.World(loopbit.WorldOptions(frames=60, spacing_m=4.0, width_px=160, height_px=120))
run = loopbit.run_folder(world.source(), "run")
assert "<title>" in pathlib.Path(loopbit.write_report(run)).read_text()
END
