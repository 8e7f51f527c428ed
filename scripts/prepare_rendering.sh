#!/usr/bin/env bash
# Makes sure that videos can be drawn without a display, installing software OpenGL where that is allowed.
# Without root it goes on and says what will be missing: training needs no OpenGL.
set -euo pipefail
cd -P "$(dirname "${BASH_SOURCE[0]}")/.."

draws() {
    .venv/bin/python -c 'import sys; from hcpg.loops import doctor; sys.exit(doctor.rendering().ok is not True)'
}

draws && exit
if [ "$(id -u)" -eq 0 ]; then
    echo "Installing software OpenGL, for the videos ..."
    scripts/install_system_packages.sh opengl || echo "The system packages could not be installed; the reason is above." >&2
    draws && exit
fi
.venv/bin/python -c '
from hcpg.loops import doctor
finding = doctor.rendering()
print(f"No videos will be drawn: {finding.value}")
print(f"  Training and its plots need no OpenGL, so the demo goes on. For videos: {finding.cure}")' >&2
