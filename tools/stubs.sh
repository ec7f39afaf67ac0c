#!/usr/bin/env bash
# Regenerates the type stubs of withe._core. With --check it only compares them, and fails when they differ.
# Stubs are a matter of the Python that made them, so they are those of Python 3.11.
set -euo pipefail
cd "$(dirname "$0")/.."
target=python/withe/_core.pyi

version=$(python -c 'import sys; print("%d.%d" % sys.version_info[:2])')
if [[ "$version" != 3.11 ]]; then
  echo "Stubs are generated and compared on Python 3.11; this is $version: skipped."
  exit 0
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# Outside the checkout, so that the installed package is what is looked at.
(cd "$scratch" && pybind11-stubgen --exit-code --output-dir "$scratch" withe._core)
made="$scratch/withe/_core.pyi"
# The bindings do not state what a dict or a tuple holds. The version changes with each commit after a release.
sed -i -E 's/^__version__: str = .*/__version__: str/; s/\bdict([,:)]|$)/dict[str, typing.Any]\1/; s/ClassVar\[tuple\]/ClassVar[tuple[typing.Any, ...]]/; s/-> tuple:/-> tuple[typing.Any, ...]:/' "$made"
ruff format --quiet --isolated --line-length 120 "$made"

if [[ "${1:-}" == --check ]]; then
  if ! diff -u "$target" "$made"; then
    echo "$target is out of date: run make stubs" >&2
    exit 1
  fi
  echo "$target is up to date."
else
  cp "$made" "$target"
  echo "$target written."
fi
