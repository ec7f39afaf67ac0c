#!/usr/bin/env bash
# Installs what is missing of the system packages that the engine is built with (Debian 12, Ubuntu 24.04 or newer).
# Prints every command before it runs. Inside an activated conda environment there is nothing to do.
set -euo pipefail

packages=(g++ python3-venv python3-dev ca-certificates libsuitesparse-dev libeigen3-dev libgtest-dev libbenchmark-dev)

explain() {
  cat >&2 <<MESSAGE

Without root the packages cannot be installed. Either an administrator runs

    apt-get update && apt-get install -y --no-install-recommends ${missing[*]}

or, without any administrator, conda brings everything:

    conda env create -f environment.yml && conda activate withe

Then run make again.
MESSAGE
  exit 1
}

if [[ -n "${CONDA_PREFIX:-}" ]] && find "$CONDA_PREFIX/include" -name klu.h 2>/dev/null | grep -q .; then
  echo "Using the libraries of the conda environment $CONDA_PREFIX"
  exit 0
fi

if ! command -v apt-get >/dev/null; then
  if [[ "$(uname)" == Darwin ]] && command -v brew >/dev/null; then
    echo "macOS (untested): make sure that this has run: brew install eigen suite-sparse googletest google-benchmark" >&2
    exit 0
  fi
  missing=("${packages[@]}")
  echo "This is no Debian or Ubuntu; the packages are named as there." >&2
  explain
fi

missing=()
for package in "${packages[@]}"; do
  if [[ "$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]]; then
    missing+=("$package")
  fi
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

as_root=()
if [[ "$(id -u)" -ne 0 ]]; then
  command -v sudo >/dev/null || explain
  as_root=(sudo)
fi

run() {
  echo "+ $*"
  "$@" >/dev/null
}
echo "Missing system packages: ${missing[*]}"
run "${as_root[@]}" apt-get update -qq || explain
run "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" ||
  explain
