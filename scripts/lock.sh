#!/usr/bin/env bash
# Writes requirements/*.txt anew: the exact versions that pip resolves today for each extra (`make lock`).
# run.txt is the whole closure of what `make demo` needs; each other file names what its target adds to it.
# The files hold no addresses, so they install from any index.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=.venv/bin/python
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: >"$work/pins"

resolve() { # resolve NAME REQUIREMENT...: pip's answer that agrees with all files written so far
    local name=$1
    shift
    "$python" -m pip install --quiet --dry-run --ignore-installed --report "$work/report.json" \
        --constraint "$work/pins" "$@"
    "$python" - "$work/report.json" >"$work/closure" <<'PYTHON'
import json
import re
import sys

for item in json.load(open(sys.argv[1]))["install"]:
    name, version = item["metadata"]["name"], item["metadata"]["version"]
    if name != "hcpg-flow":
        print(re.sub("[-_.]+", "-", name).lower() + "==" + version.partition("+")[0])
PYTHON
    echo "# Written by scripts/lock.sh, for CPython 3.11 to 3.13 on Linux." >"$work/$name.txt"
    if [ "$name" = run ]; then
        sort "$work/closure" >>"$work/run.txt"
    else
        { echo "-r run.txt"; sort "$work/closure" | grep -vxFf "$work/run.txt"; } >>"$work/$name.txt"
    fi
    grep == "$work/$name.txt" >>"$work/pins"
    sort -u -o "$work/pins" "$work/pins"
    echo "requirements/$name.txt: $(grep -c == "$work/$name.txt") packages"
}

resolve run '.[train,metaworld,video,plots,statistics]' 'hatchling>=1.27,<2' 'editables>=0.5'
resolve test '.[test]'
resolve lint '.[lint]'
resolve bench '.[bench]'
mv "$work"/{run,test,lint,bench}.txt requirements/
