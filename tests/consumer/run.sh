#!/usr/bin/env bash
# Proves the package from outside: installs a build, then builds and runs a program against it, by
# find_package and by pkg-config.
#
#   run.sh BUILD_DIR SCRATCH    leaves the installed package in SCRATCH/prefix
#   run.sh --installed SCRATCH  takes what the system has installed
set -euo pipefail

build=$1
scratch=$2
source=$(dirname "$(readlink -f "$0")")

rm -rf "$scratch"
mkdir -p "$scratch"
if [[ $build == --installed ]]; then
  prefix=/usr
else
  prefix=$scratch/prefix
  cmake --install "$build" --prefix "$prefix" >"$scratch/install.log"
  export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
  # Where other tests look for the Python module, whatever its version.
  for folder in "$prefix"/lib/python3.*; do
    [[ ! -d $folder ]] || ln -s "$(basename "$folder")" "$prefix/lib/python3"
  done
fi
cmake -S "$source" -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$prefix"
cmake --build "$scratch/build"

is_static=
[[ ! -e $prefix/lib/libloopbit.a ]] || is_static=yes
read -ra flags < <(pkg-config --cflags --libs "$([[ $is_static ]] && echo --static || echo --shared)" loopbit)
if [[ " ${flags[*]} " =~ " -l"(sqlite3|deflate)" " ]]; then
  echo "run.sh: a program that only detects links what maps need: ${flags[*]}" >&2
  exit 1
fi
g++ -std=c++20 "$source/main.cpp" "${flags[@]}" -lopencv_imgcodecs -o "$scratch/by_pkg_config"

"$source/../configure_again" "$scratch/build" "$source/components" "$scratch/components"
# The components that are there, also where SQLite, zlib and pkg-config are not, which only some need.
components() {
  cmake -U'CMAKE_DISABLE_FIND_PACKAGE_*' "$@" "$scratch/components" | tee "$scratch/found"
}
components
for component in loopbit images poses graph map fleet recordings data both; do
  grep -qxF -e "-- found $component" "$scratch/found"
done
if [[ $is_static ]]; then
  components -DCMAKE_DISABLE_FIND_PACKAGE_ZLIB=ON
  [[ $(grep -e '-- found' "$scratch/found") == $'-- found loopbit\n-- found images\n-- found poses\n-- found graph\n-- found map\n-- found fleet' ]]
  grep -qF -e '-- not both: loopbit::data is not there: zlib or matio' "$scratch/found"
  for without in -DCMAKE_DISABLE_FIND_PACKAGE_{SQLite3,PkgConfig}=ON; do
    components "$without"
    [[ $(grep -e '-- found' "$scratch/found") == $'-- found loopbit\n-- found images\n-- found poses\n-- found graph' ]]
    grep -qF -e '-- not both: loopbit::data is not there: SQLite or libdeflate' "$scratch/found"
  done
  components -DCMAKE_DISABLE_FIND_PACKAGE_yaml-cpp=ON
  [[ $(grep -e '-- found' "$scratch/found") == $'-- found loopbit\n-- found images\n-- found map'* ]]
fi

if grep -rE -e '-m(avx|sse|arch|tune)' "$prefix"/lib/{,*/}{cmake/loopbit,pkgconfig/loopbit*} 2>/dev/null; then
  echo "run.sh: instruction-set flags reach whoever links loopbit." >&2
  exit 1
fi

for image in first second; do
  { printf 'P5\n320 240\n255\n' && head -c 76800 <(seq 100000); } >"$scratch/$image.pgm"
done
for program in build/consumer by_pkg_config; do
  "$scratch/$program" "$scratch/first.pgm" "$scratch/second.pgm"
done
