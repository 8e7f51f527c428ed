#!/usr/bin/env bash
# Installs the system libraries that draw pictures and videos without a display (OpenGL in software, by Mesa).
# Debian and Ubuntu. Does nothing where they are all there; works as root, or through sudo.
set -euo pipefail

readonly packages=(libegl1 libgl1-mesa-dri)

is_installed() { # is_installed PACKAGE
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "This is no Debian or Ubuntu: install Mesa's EGL library (libEGL.so.1) and its software driver \
with this system's own package manager." >&2
    exit 1
fi

missing=()
for package in "${packages[@]}"; do
    is_installed "$package" || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    echo "Nothing to install: ${packages[*]} are there."
    exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "Missing: ${missing[*]}. This needs root, and there is no sudo; as root: apt-get install ${missing[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi

echo "Installing ${missing[*]} (OpenGL without a display) with apt-get ..."
# The ${...[@]+} form: an empty array is an unset variable to older versions of bash.
${as_root[@]+"${as_root[@]}"} apt-get update -qq
${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
echo "Installed ${missing[*]}."
