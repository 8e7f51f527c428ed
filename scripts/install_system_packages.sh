#!/usr/bin/env bash
# Installs system libraries that the simulators load, for each purpose that is named, or for all:
#   sapien  without which ManiSkill and its simulator SAPIEN cannot be imported (Meta-World needs none)
#   opengl  with which MuJoCo (Meta-World) draws without a display and without a GPU, by Mesa
#   vulkan  with which SAPIEN (ManiSkill) does, by Mesa 24 or newer
#   browser Chromium, in which the tests open a report's page; installed where it is named only
# Debian and Ubuntu; works as root, or through sudo, and does nothing where they are all there. Debian 12 has a
# new enough Vulkan driver in its backports alone, so there the script adds Debian's backports, from which apt
# takes nothing but what it is asked for, and what that needs.
set -euo pipefail

readonly sapien_packages=(libx11-6 libgl1 libglib2.0-0)
readonly opengl_packages=(libegl1 libgl1-mesa-dri)
readonly browser_packages=(chromium)
readonly vulkan_packages=(libvulkan1 mesa-vulkan-drivers) oldest_driver=24
readonly backports_list=${APT_SOURCES:-/etc/apt/sources.list.d}/hcpg-flow-backports.list
readonly debian_keys=/usr/share/keyrings/debian-archive-keyring.gpg os_release=${OS_RELEASE:-/etc/os-release}

refuse() {
    echo "$*" >&2
    exit 1
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

installed_version() { # installed_version PACKAGE: empty where it is not installed
    local name status
    for name in "$1" "$1t64"; do # what newer systems call libraries with a 64-bit time
        status=$(dpkg-query -W -f='${db:Status-Status} ${Version}' "$name" 2>/dev/null) || continue
        [ "${status%% *}" != installed ] || echo "${status#* }"
    done
}

offered_version() { # offered_version PACKAGE: what apt would install; empty where it knows none
    LC_ALL=C apt-cache policy "$1" | sed -n 's/^ *Candidate: *//p' | sed 's/(none)//'
}

suffices() { # suffices PACKAGE VERSION
    [ -n "$2" ] && { [ "$1" != mesa-vulkan-drivers ] || dpkg --compare-versions "$2" ge "$oldest_driver"; }
}

provide_driver() { # make apt know a Vulkan driver that SAPIEN accepts, and set `release` to where it is
    local offered
    offered=$(offered_version mesa-vulkan-drivers)
    suffices mesa-vulkan-drivers "$offered" && return
    grep -qs '^VERSION_CODENAME=bookworm' "$os_release" || refuse "SAPIEN draws with mesa-vulkan-drivers $oldest_driver \
or newer, and this system offers ${offered:-none}. Use Debian 12 or newer, or Ubuntu 24.04 or newer, or install a newer \
Mesa. Training needs none; install the rest by: scripts/install_system_packages.sh sapien opengl"
    echo "Adding Debian's backports in $backports_list, for the Vulkan driver ..."
    echo "deb [signed-by=$debian_keys] http://deb.debian.org/debian bookworm-backports main" |
        as_root tee "$backports_list" >/dev/null
    as_root apt-get update -qq
    release=(-t bookworm-backports)
}

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    refuse "This is no Debian or Ubuntu: install Mesa's EGL library (libEGL.so.1) with its software driver, and its \
Vulkan driver lavapipe ($oldest_driver or newer), with this system's own package manager."
fi

purposes=("$@")
[ $# -gt 0 ] || purposes=(sapien opengl vulkan)
wanted=()
for purpose in "${purposes[@]}"; do
    case "$purpose" in
    sapien) wanted+=("${sapien_packages[@]}") ;;
    opengl) wanted+=("${opengl_packages[@]}") ;;
    vulkan) wanted+=("${vulkan_packages[@]}") ;;
    browser) wanted+=("${browser_packages[@]}") ;;
    *) refuse "there is nothing to install for '$purpose'. Known: sapien, opengl, vulkan, browser." ;;
    esac
done

missing=()
for package in "${wanted[@]}"; do
    suffices "$package" "$(installed_version "$package")" || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    echo "Nothing to install: ${wanted[*]} are there."
    exit 0
fi
if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null; then
    refuse "Missing: ${missing[*]}. This needs root, and there is no sudo; as root: scripts/install_system_packages.sh"
fi

echo "Installing ${missing[*]} with apt-get ..."
release=()
as_root apt-get update -qq
[[ " ${missing[*]} " != *" mesa-vulkan-drivers "* ]] || provide_driver
# The ${...[@]+} form: an empty array is an unset variable to older versions of bash.
as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    ${release[@]+"${release[@]}"} "${missing[@]}"
echo "Installed ${missing[*]}."
