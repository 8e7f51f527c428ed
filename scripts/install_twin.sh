#!/usr/bin/env bash
# Makes .venv-twin, where the served twin runs, from requirements/twin.txt; adds the arm's driver to .venv.
# A second call finds its stamp and returns at once, without network. PYTHON=/path names a Python 3.11.
set -euo pipefail
cd -P "$(dirname "${BASH_SOURCE[0]}")/.."

readonly lock=requirements/twin.txt environment=.venv-twin stamp=.venv-twin/installed
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PIP_REQUIRE_VIRTUALENV=1
unset PIP_USER PIP_TARGET PIP_PREFIX
python=${PYTHON:-python3.11}

fingerprint() { { pwd; cat "$lock"; } | cksum; }

has_driver() { .venv/bin/python -c 'import franky' 2>/dev/null; }

pip_install() { # pip_install ENVIRONMENT ARGUMENT...
    local into=$1
    shift
    "$into/bin/python" -m pip install --quiet --retries 2 --no-deps "$@" && return
    echo "The installation stopped; pip says why above. Run the same command again to go on." >&2
    exit 1
}

if [ "$(cat "$stamp" 2>/dev/null)" != "$(fingerprint)" ]; then
    if ! "$python" -c 'import ensurepip, venv, sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then
        echo "The served twin needs Python 3.11 with venv ($python is none). Debian 12: sudo apt-get install \
python3.11-venv; or name one: make twin PYTHON=/path/to/python3.11" >&2
        exit 1
    fi
    echo "Installing $(grep -cv '^#' "$lock") packages of $lock into $environment ..."
    "$python" -m venv --clear "$environment"
    pip_install "$environment" -r "$lock"
    # hcpg itself asks for a newer NumPy than franka-sim allows; its twin runs with both, so it is put on the path.
    pwd | sed 's|$|/src|' >"$("$environment/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/hcpg.pth"
    fingerprint >"$stamp"
fi
if ! has_driver; then
    echo "Installing the arm's driver into .venv ..."
    grep -E '^(franky-control|websockets)==' "$lock" >"$environment/driver.txt"
    pip_install .venv -r "$environment/driver.txt"
fi
echo "Ready. Serve a task: .venv-twin/bin/python -m hcpg.twin.serving --task peg-insertion"
echo "Then look at it:     .venv/bin/hcpg robot check franka/peg-insertion --robot twin --address 127.0.0.1"
