#!/usr/bin/env bash
# Makes the tarballs of a release from BUILD_DIR: the sources are all files of the repository, and the
# command runs where its tarball is unpacked.
#
#   tarballs_test.sh BUILD_DIR SCRATCH
set -euo pipefail

build=$1
scratch=$2
root=$(dirname "$(dirname "$(readlink -f "$0")")")
version=$(sed -n 's/^  VERSION //p' "$root/CMakeLists.txt")
rm -rf "$scratch"
mkdir -p "$scratch"

cpack --config "$build/CPackSourceConfig.cmake" -B "$scratch" >"$scratch/log"
tar -tf "$scratch/loopbit-$version.tar.gz" | grep -v '/$' | sed "s|^loopbit-$version/||" | sort >"$scratch/packed"
git -C "$root" ls-files --cached --others --exclude-standard | sort >"$scratch/expected"
diff "$scratch/expected" "$scratch/packed"

cpack --config "$build/CPackConfig.cmake" -G TGZ -B "$scratch" >>"$scratch/log"
tar -xf "$scratch/loopbit-$version-Linux-$(uname -m).tar.gz" -C "$scratch"
unpacked=$scratch/loopbit-$version-Linux-$(uname -m)
[[ $("$unpacked/bin/loopbit" --version) == "$version" ]]
cmp "$root/LICENSE" "$unpacked/share/doc/loopbit/LICENSE"
test -s "$unpacked/include/loopbit/loop_detector.hpp"
