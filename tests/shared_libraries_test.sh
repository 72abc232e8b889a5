#!/usr/bin/env bash
# Links the static libraries installed in PREFIX as shared ones: each must do with what the public
# headers of the others declare, and show nothing that is not in the namespace loopbit.
#
#   shared_libraries_test.sh PREFIX SCRATCH
set -euo pipefail

prefix=$1
scratch=$2
exports=$(dirname "$(dirname "$(readlink -f "$0")")")/cmake/exports.map
rm -rf "$scratch"
mkdir -p "$scratch"

# link NAME OTHERS...: with the libraries that NAME.pc names.
link() {
  local name=$1
  local -a libraries
  shift
  read -ra libraries < <(sed -n 's/^Libs.private: //p' "$prefix/lib/pkgconfig/$name.pc")
  g++ -shared -o "$scratch/lib$name.so" -Wl,--version-script="$exports" -Wl,-z,defs \
    -Wl,--whole-archive "$prefix/lib/lib$name.a" -Wl,--no-whole-archive \
    -L"$scratch" "$@" "${libraries[@]}" -lopencv_core
  nm -DC --defined-only "$scratch/lib$name.so" | cut -c 20- >"$scratch/$name.symbols"
  if grep -v '^\(vtable for \|typeinfo for \|typeinfo name for \)\?loopbit::' "$scratch/$name.symbols"; then
    echo "shared_libraries_test: $name shows what is not ours." >&2
    exit 1
  fi
  echo "lib$name.so shows $(wc -l <"$scratch/$name.symbols") symbols"
}

link loopbit
link loopbit_map -lloopbit
link loopbit_fleet -lloopbit_map -lloopbit
link loopbit_images -lloopbit
link loopbit_recordings -lloopbit_images -lloopbit_map -lloopbit
link loopbit_poses -lloopbit -lopencv_calib3d -lyaml-cpp
link loopbit_graph -lloopbit_poses -lloopbit
link loopbit_data -lloopbit_graph -lloopbit_poses -lloopbit_images -lloopbit_map -lloopbit
link loopbit_report -lloopbit_data -lloopbit_graph -lloopbit_poses -lloopbit_images -lloopbit_map -lloopbit

grep -q '^loopbit::LoopDetector::process(' "$scratch/loopbit.symbols"
# Of a class with virtual functions, what its users link.
grep -qx 'vtable for loopbit::RunInput' "$scratch/loopbit_data.symbols"
# Of the private headers nothing.
for hidden in loopbit::HessianPyramid loopbit::report:: '::Impl::'; do
  if grep -F "$hidden" "$scratch"/*.symbols; then
    echo "shared_libraries_test: $hidden is visible, but no public header declares it." >&2
    exit 1
  fi
done
