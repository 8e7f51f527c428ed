#!/usr/bin/env bash
# A robot's computer, as far as Python goes: an environment with this package and its extra `deploy` (NumPy, safetensors) alone,
# in which an exported policy is loaded, timed at 30 Hz, and run through the control loop on the point arm.
#
#   scripts/robot_computer.sh FOLDER [SECONDS [ENVIRONMENT]]
#
# ENVIRONMENT is made if it is not there; without it, a new one is made and removed again.
set -euo pipefail
root="$(cd "$(dirname "$0")/.." && pwd)"
policy="$(realpath "$1")"
seconds="${2:-60}"
place="$(mktemp -d)"
trap 'rm -rf "$place"' EXIT
environment="${3:-$place/venv}"

if [[ ! -x "$environment/bin/hcpg" ]]; then
  python3 -m venv "$environment"
  "$environment/bin/pip" install --quiet --disable-pip-version-check "$root[deploy]"
fi
ln -s "$policy" "$place/policy"
cd "$place"  # away from the checkout, so that nothing of it can be imported

show() {
  echo "\$ $*"
  "$environment/bin/$1" "${@:2}" 2>&1 || echo "(exit code $?)"
}
show pip list --disable-pip-version-check
show python -c "import jax"
show python -m hcpg.loops.control.deployed policy --seconds "$seconds"
show hcpg robot run point/reach --robot point --policy policy --episodes 20 --out run
