#!/usr/bin/env bash
# Installs the locked packages of the named sets (run, test, lint, bench) and the project itself into .venv.
# A second call finds its stamps and returns at once, without network. PYTHON=/path chooses the interpreter.
set -euo pipefail
cd -P "$(dirname "${BASH_SOURCE[0]}")/.."

readonly needed_disk_gb=4 needed_temporary_gb=1 torch_cpu_index=https://download.pytorch.org/whl/cpu
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PIP_REQUIRE_VIRTUALENV=1
unset PIP_USER PIP_TARGET PIP_PREFIX
problems=()
candidates=(python3.11 python3.12 python3.13 python3)
[ -z "${PYTHON:-}" ] || candidates=("$PYTHON")

fingerprint() { # of everything that an installation depends on, the folder's own place too
    { pwd; cat pyproject.toml requirements/run.txt "requirements/$1.txt"; } | cksum
}

is_current() { # is_current SET
    [ -x .venv/bin/python ] && [ "$(cat ".venv/installed-$1" 2>/dev/null)" = "$(fingerprint "$1")" ]
}

supports() { # supports PYTHON: is it one of the versions that MuJoCo 3.3.0 has builds for
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null
}

makes_environments() { # makes_environments PYTHON: Debian ships Python without venv's heart, ensurepip
    "$1" -c 'import ensurepip, venv' 2>/dev/null
}

find_python() { # prints the interpreter to use, or notes what is missing
    local candidate found=
    for candidate in "${candidates[@]}"; do
        supports "$candidate" || continue
        found=${found:-$candidate}
        if makes_environments "$candidate"; then
            python=$candidate
            return
        fi
    done
    if [ -n "$found" ]; then
        local version
        version=$("$found" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        problems+=("$found cannot make virtual environments. Debian, Ubuntu: sudo apt-get install python$version-venv")
    else
        problems+=("no Python 3.11, 3.12 or 3.13 among: ${candidates[*]} \
($(python3 --version 2>/dev/null || echo "no python3 at all")). Debian 12 or later, Ubuntu 24.04 or later: \
sudo apt-get install python3 python3-venv; or name one: make install PYTHON=/path/to/python3.11")
    fi
}

check_disk() { # check_disk FOLDER GIGABYTES PURPOSE
    local free_kb
    free_kb=$(df -Pk "$1" | awk 'NR == 2 { print $4 }')
    if [ "$free_kb" -lt $(($2 * 1000000)) ]; then
        problems+=("$(df -Pk "$1" | awk 'NR == 2 { print $6 }') has $((free_kb / 1000)) MB free, $3 needs $2 GB. \
Free some space, or set $4.")
    fi
}

check_machine() {
    command -v git >/dev/null ||
        problems+=("git is missing (runs record their commit). Debian, Ubuntu: sudo apt-get install git")
    check_disk . "$needed_disk_gb" "the installation" "up the project on another disk"
    check_disk "${TMPDIR:-/tmp}" "$needed_temporary_gb" "unpacking packages" "TMPDIR to a folder on another disk"
    is_environment_sound || find_python
    if [ ${#problems[@]} -gt 0 ]; then
        echo "HCPG-Flow cannot be installed yet:" >&2
        printf '  - %s\n' "${problems[@]}" >&2
        exit 1
    fi
}

is_environment_sound() { # false for one half made, of another Python, or moved here with its folder
    supports .venv/bin/python && grep -qsF "$PWD/.venv" .venv/bin/activate &&
        .venv/bin/python -m pip --version >/dev/null 2>&1
}

make_environment() {
    is_environment_sound && return
    if [ -e .venv ]; then echo "Replacing .venv: it is incomplete, moved, or of another Python."; fi
    "$python" -m venv --clear .venv
}

pip_install() {
    .venv/bin/python -m pip install --quiet --retries 2 "$@" && return
    echo "The installation stopped; pip says why above. The first one needs the network; \
run the same command again to go on." >&2
    exit 1
}

install_torch() { # install_torch LOCK: PyPI's build of torch for Linux brings gigabytes of CUDA; prefer the CPU's
    local torch
    torch=$(grep '^torch==' "$1") || return 0
    if [ -d .venv/lib/python3*/site-packages/torch ] || [ "$(uname -s)" != Linux ]; then return 0; fi
    if timeout 3 .venv/bin/python -c "import urllib.request as r; r.urlopen('$torch_cpu_index/')" 2>/dev/null; then
        pip_install --no-deps --index-url "$torch_cpu_index" "$torch"
    fi
}

install() { # install SET
    local lock=requirements/$1.txt start=$SECONDS
    echo "Installing $(sed -n 's/==/ /p' requirements/run.txt "$lock" | sort -u | wc -l) packages of $lock into .venv ..."
    install_torch "$lock"
    pip_install -r "$lock"
    # hatchling comes from the lock: no build environment, so no network.
    pip_install --no-build-isolation --no-deps --editable .
    fingerprint "$1" >".venv/installed-$1"
    echo "Done after $((SECONDS - start)) s; .venv holds $(du -sm .venv | cut -f1) MB."
}

for set in "${@:-run}"; do
    if [ ! -f "requirements/$set.txt" ]; then
        echo "no set is named '$set'. Known: run, test, lint, bench." >&2
        exit 2
    fi
    is_current "$set" && continue
    check_machine
    make_environment
    install "$set"
done
