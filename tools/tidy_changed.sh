#!/usr/bin/env bash
# tidy_changed.sh BUILD [BASE]: clang-tidy over the C++ sources that changed since BASE (see changed_files.sh; the commit
# before this one where there is none). Uses the compile commands of the given build folder. The slow static analyzer
# runs in make tidy only.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1
export BASE=${2:-}

# Benchmarks are not part of the build whose commands are used.
sources=('cpp/*.cpp' 'python/*.cpp' 'tests/*.cpp')
if ! changed=$(tools/changed_files.sh "${sources[@]}" 2>/dev/null || BASE=HEAD~1 tools/changed_files.sh "${sources[@]}" 2>/dev/null); then
  echo "No earlier commit to compare with: clang-tidy skipped (make tidy looks at every file)."
  exit 0
fi
files=()
while read -r file; do
  [[ -f "$file" ]] && files+=("$file")
done <<<"$changed"
echo "clang-tidy: ${#files[@]} changed files"
[[ ${#files[@]} -eq 0 ]] && exit 0
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy --quiet --checks='-clang-analyzer-*' -p "$build" 2> >(grep -v 'warnings generated' >&2)
