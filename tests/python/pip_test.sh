#!/usr/bin/env bash
# Proves that the source archive has what CMake needs, and that pip installs the package from it,
# without a network: into a virtual environment that sees what Debian packages. The compiled part
# comes from BUILD_DIR.
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
cp -r "$root"/{CMakeLists.txt,LICENSE,MANIFEST.in,README.md,pyproject.toml,setup.py,cmake,python,src,tools} \
  "$scratch/tree"
version=$(sed -n 's/^  VERSION //p' "$root/CMakeLists.txt")
(cd "$scratch/tree" && "$python" setup.py --quiet sdist --dist-dir "$scratch")
archive=$scratch/loopbit-$version.tar.gz
tar -xf "$archive" -C "$scratch"
for part in cmake python src tools; do
  diff -r --exclude='*.egg-info' --exclude=__pycache__ "$scratch/tree/$part" "$scratch/loopbit-$version/$part"
done
cmake -S "$scratch/loopbit-$version" -B "$scratch/configured" -G Ninja --log-level=WARNING \
  -DLOOPBIT_BUILD_PYTHON=ON -DLOOPBIT_BUILD_CLI=ON -DLOOPBIT_BUILD_TESTS=OFF \
  -DLOOPBIT_BUILD_BENCHMARKS=OFF -DPython3_EXECUTABLE="$python"

# Debian has pip.
"$python" -m venv --system-site-packages --without-pip "$scratch/venv"
PIP_NO_INDEX=1 PIP_DISABLE_PIP_VERSION_CHECK=1 LOOPBIT_BUILD_DIR=$build \
  "$scratch/venv/bin/python" -m pip install --quiet --no-build-isolation "$archive"
cd "$scratch"
"$scratch/venv/bin/loopbit" demo --frames 60 --world spacing_m=4 --world width_px=160 \
  --world height_px=120 --write-images town 2>progress
"$scratch/venv/bin/python" - "$version" town/images <<'END'
import importlib.metadata
import importlib.resources
import pathlib
import sys

import loopbit

assert loopbit.__version__ == importlib.metadata.version("loopbit") == sys.argv[1]
assert "venv" in pathlib.Path(loopbit.__file__).parts, loopbit.__file__
assert {"py.typed", "_loopbit.pyi"} <= {f.name for f in importlib.resources.files(loopbit).iterdir()}
run = loopbit.run_folder(sys.argv[2], "run")
assert "<title>" in pathlib.Path(loopbit.write_report(run)).read_text()
END
