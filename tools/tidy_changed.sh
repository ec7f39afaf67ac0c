#!/usr/bin/env bash
# clang-tidy over the C++ sources that changed since BASE (first argument; otherwise where this branch left the
# published main branch, or the commit before this one). Uses the compile commands of the given build folder. The slow
# static analyzer runs in make tidy only.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1
base=${2:-}
if [[ -z "$base" ]]; then
  base=$(git merge-base HEAD origin/main 2>/dev/null || true)
  [[ -z "$base" || "$base" == "$(git rev-parse HEAD)" ]] && base=$(git rev-parse --quiet --verify HEAD~1 || true)
fi
if [[ -z "$base" ]]; then
  echo "No earlier commit to compare with: clang-tidy skipped (make tidy looks at every file)."
  exit 0
fi

# Benchmarks are not part of the build whose commands are used.
sources=('cpp/*.cpp' 'python/*.cpp' 'tests/*.cpp')
mapfile -t files < <(
  { git diff --name-only --diff-filter=d "$base" -- "${sources[@]}"; git ls-files --others --exclude-standard -- "${sources[@]}"; } | sort -u
)
echo "clang-tidy: ${#files[@]} files changed since ${base:0:9}"
[[ ${#files[@]} -eq 0 ]] && exit 0
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy --quiet --checks='-clang-analyzer-*' -p "$build" 2> >(grep -v 'warnings generated' >&2)
