#!/usr/bin/env bash
# One step of the study of docs/evidence/robot_study_served, for one task:
#
#     scripts/robot_study.sh demos|clone|learn|trials TASK OUT [ADDRESS]
#
# All of it is on the served twin, in real time: leave it both cores. What is finished is not run again, and
# what was cut off is taken up, so the same call goes on after a stop.
set -euo pipefail

step=$1 task=$2 out=$3 address=${4:-127.0.0.1}
hcpg=${HCPG:-hcpg}
twin=(--robot twin --address "$address" --serve)
demos=$out/demos/$task clones=$out/clone/$task
mkdir -p "$out/demos" "$clones"

made() { if [ -d "$1" ]; then find "$1" -name config.json -printf '%h\n' | sort | tail -n 1; fi; }
state() { python3 -c 'import json, sys; print(json.load(open(sys.argv[1] + "/status.json"))["state"])' "$1"; }

case $step in
demos)
    [ -f "$demos.done" ] && exit 0
    rm -rf "$demos" # a recording that was cut off
    $hcpg robot demos "franka/$task" "${twin[@]}" --count 20 --source expert --seed 0 --out "$demos"
    touch "$demos.done"
    ;;
clone)
    [ -f "$clones.done" ] && exit 0
    rm -rf "$clones"
    $hcpg robot clone "$demos" --preset hcpg_flow --seed 0 --out "$clones"
    touch "$clones.done"
    ;;
learn)
    for preset in hcpg_flow sac_flow; do
        run=$(made "$out/learn/$task/$preset")
        if [ -z "$run" ]; then
            $hcpg robot learn "franka/$task" "${twin[@]}" --initial "$(made "$clones")" --demos "$demos" \
                --preset $preset --seed 0 --out "$out/learn/$task/$preset"
        elif [ "$(state "$run")" != finished ]; then
            $hcpg robot learn "franka/$task" "${twin[@]}" --resume "$run"
        fi
    done
    ;;
trials)
    # The initial policy without a selector, as sac_flow has none: what both methods began with.
    $hcpg robot trials "franka/$task" "${twin[@]}" --unattended --trials 15 --seed 0 --out "$out/trials" \
        --policy sac_flow="$(made "$out/learn/$task/sac_flow")" \
        --policy hcpg_flow="$(made "$out/learn/$task/hcpg_flow")" \
        --policy initial="$(made "$clones")" --selector initial=first
    ;;
*)
    echo "unknown step '$step'; one of: demos clone learn trials" >&2
    exit 2
    ;;
esac
