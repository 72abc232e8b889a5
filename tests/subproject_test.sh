#!/usr/bin/env bash
# Configures loopbit as a part of another project, which forces a header on all sources, asks for
# shared libraries, and is installed to a folder of its own; and builds a part of it.
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

cmake -S "$scratch/project" -B "$scratch/build" -G Ninja --log-level=WARNING \
  -DBUILD_SHARED_LIBS=ON -DLOOPBIT_BUILD_CLI=ON -DCMAKE_INSTALL_PREFIX="$scratch/prefix"
cmake --build "$scratch/build" --target loopbit_base
grep -qF "NEW_RPATH \"\\\$ORIGIN/../lib\"" "$scratch/build/loopbit/src/cli/cmake_install.cmake"
echo "a part of another project is built, and its command finds the libraries installed with it"
