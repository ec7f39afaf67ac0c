#!/usr/bin/env bash
# Prints the Python that .venv is made from: conda's inside an environment, otherwise the system's.
set -euo pipefail

candidates=(/usr/bin/python3 python3 python3.14 python3.13 python3.12 python3.11)
[[ -n "${CONDA_PREFIX:-}" ]] && candidates=("$CONDA_PREFIX/bin/python3" "${candidates[@]}")
for candidate in "${candidates[@]}"; do
  if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    command -v "$candidate"
    exit 0
  fi
done
echo "No Python 3.11 or newer was found; name one: make PYTHON=/path/to/python3" >&2
exit 1
