#!/usr/bin/env bash
# Configures loopbit as a part of another project, which forces a header on all sources, asks for
# shared libraries, and is installed to a folder of its own; and builds a part of it. Does it again
# with the detector alone, where what only the rest needs is not found.
#
#   subproject_test.sh SCRATCH
set -euo pipefail

scratch=$1
root=$(dirname "$(dirname "$(readlink -f "$0")")")
rm -rf "$scratch"
mkdir -p "$scratch/project"
cat >"$scratch/project/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(robot LANGUAGES CXX)
add_compile_options(-include \${CMAKE_CURRENT_SOURCE_DIR}/forced.hpp)
add_subdirectory($root loopbit)
END
echo '#define ROBOT 1' >"$scratch/project/forced.hpp"

# configure BUILD OPTIONS...
configure() {
  cmake -S "$scratch/project" -B "$scratch/$1" -G Ninja --log-level=WARNING -DBUILD_SHARED_LIBS=ON "${@:2}"
}
configure build -DLOOPBIT_BUILD_CLI=ON -DCMAKE_INSTALL_PREFIX="$scratch/prefix"
cmake --build "$scratch/build" --target loopbit_base
grep -qF "NEW_RPATH \"\\\$ORIGIN/../lib\"" "$scratch/build/loopbit/src/cli/cmake_install.cmake"
echo "a part of another project is built, and its command finds the libraries installed with it"

without=()
for package in SQLite3 ZLIB PkgConfig Threads CLI11 GTest; do
  without+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON")
done
configure detector -DLOOPBIT_DETECTOR_ONLY=ON "${without[@]}"
linked=$(ninja -C "$scratch/detector" -t commands all | grep -oE '/lib[a-z0-9_]+\.so' | grep -v loopbit | sort -u | tr -d '\n')
[[ $linked == /libfmt.so/libopencv_core.so/libopencv_imgproc.so ]] || { echo "the detector links $linked" >&2 && exit 1; }
if configure detector -DLOOPBIT_BUILD_CLI=ON 2>"$scratch/error"; then
  echo "a command without its libraries is not refused" >&2 && exit 1
fi
grep -qF "LOOPBIT_DETECTOR_ONLY leaves out what LOOPBIT_BUILD_CLI needs" "$scratch/error"
echo "the detector alone needs fmt and OpenCV's core and imgproc"
