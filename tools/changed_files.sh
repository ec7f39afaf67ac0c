#!/usr/bin/env bash
# changed_files.sh [PATHSPEC...]: the files that this branch and the working tree add, change or delete since it left the
# published main branch (or since the commit BASE of the environment). Fails where there is nothing to compare with: then
# everything counts as changed.
set -euo pipefail
cd "$(dirname "$0")/.."
base=${BASE:-$(git merge-base HEAD origin/main 2>/dev/null || true)}
if [[ -z "$base" || (-z "${BASE:-}" && "$base" == "$(git rev-parse HEAD)" && -z "$(git status --porcelain)") ]]; then
  echo "changed_files.sh: no earlier commit to compare with" >&2
  exit 1
fi
{ git diff --name-only --no-renames "$base" -- "$@"; git ls-files --others --exclude-standard -- "$@"; } | sort -u
