#!/usr/bin/env bash
# asan_python.sh BUILD SCRIPT ARGUMENTS...: run a script with the package of this tree and the module of a build folder
# that was made for the address sanitizer. An access out of bounds ends it, with the place.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1
shift

package=$build/package
rm -rf "$package" && mkdir -p "$package"
cp -r python/withe "$package"
rm -f "$package"/withe/_core*.so
cp "$build"/python/bindings/_core*.so "$package"/withe

# Leaks are not looked for: the interpreter keeps much until it ends.
export ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1:detect_stack_use_after_return=1
export UBSAN_OPTIONS=print_stacktrace=1 PYTHONMALLOC=malloc PYTHONPATH=$package OMP_NUM_THREADS=1
compiler=$(sed -n 's/^CMAKE_CXX_COMPILER:[A-Z]*=//p' "$build"/CMakeCache.txt)
LD_PRELOAD="$("$compiler" -print-file-name=libasan.so) $("$compiler" -print-file-name=libstdc++.so)" exec python "$@"
