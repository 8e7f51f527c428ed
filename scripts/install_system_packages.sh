#!/usr/bin/env bash
# Installs the system libraries that draw pictures and videos without a display and without a GPU, by Mesa:
#   opengl  what MuJoCo draws with (Meta-World)      vulkan  what SAPIEN draws with (ManiSkill), Mesa 24 or newer
# Without arguments it installs both. Training needs neither. Debian and Ubuntu; works as root, or through sudo,
# and does nothing where they are all there. Debian 12 has a new enough Vulkan driver in its backports alone,
# so there the script adds Debian's backports, from which apt takes nothing that it is not asked for by name.
set -euo pipefail

readonly opengl_packages=(libegl1 libgl1-mesa-dri)
readonly vulkan_packages=(libvulkan1 mesa-vulkan-drivers) oldest_driver=24
readonly backports_list=${APT_SOURCES:-/etc/apt/sources.list.d}/hcpg-flow-backports.list
readonly debian_keys=/usr/share/keyrings/debian-archive-keyring.gpg

installed_version() { # installed_version PACKAGE: empty where it is not installed
    local status
    status=$(dpkg-query -W -f='${db:Status-Status} ${Version}' "$1" 2>/dev/null) || return 0
    [ "${status%% *}" != installed ] || echo "${status#* }"
}

is_new_enough() { # is_new_enough PACKAGE VERSION
    [ -n "$2" ] && { [ "$1" != mesa-vulkan-drivers ] || dpkg --compare-versions "$2" ge "$oldest_driver"; }
}

candidate() { # candidate PACKAGE: the version that apt would install
    apt-cache policy "$1" | sed -n 's/^ *Candidate: *//p' | grep -v none || true
}

codename() {
    # shellcheck source=/dev/null
    . "${OS_RELEASE:-/etc/os-release}" && echo "${VERSION_CODENAME:-}"
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

refuse() {
    printf '%s\n' "$*" >&2
    exit 1
}

add_backports() {
    echo "Adding Debian's backports in $backports_list, for the Vulkan driver alone ..."
    echo "deb [signed-by=$debian_keys] http://deb.debian.org/debian bookworm-backports main" | as_root tee "$backports_list" >/dev/null
    as_root apt-get update -qq
}

provide_driver() { # make apt know a Vulkan driver that SAPIEN accepts
    is_new_enough mesa-vulkan-drivers "$(candidate mesa-vulkan-drivers)" && return
    [ "$(codename)" = bookworm ] || refuse "This system has mesa-vulkan-drivers $(candidate mesa-vulkan-drivers), \
and SAPIEN accepts $oldest_driver or newer. Use Debian 12 or newer, or Ubuntu 24.04 or newer, or a newer Mesa of your own. \
Training on ManiSkill needs none."
    add_backports
    release=(-t bookworm-backports)
}

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    refuse "This is no Debian or Ubuntu: install Mesa's EGL library (libEGL.so.1) with its software driver, and its \
Vulkan driver lavapipe ($oldest_driver or newer), with this system's own package manager."
fi

wanted=()
for purpose in "${@:-opengl vulkan}"; do
    case "$purpose" in
    opengl) wanted+=("${opengl_packages[@]}") ;;
    vulkan) wanted+=("${vulkan_packages[@]}") ;;
    "opengl vulkan") wanted+=("${opengl_packages[@]}" "${vulkan_packages[@]}") ;;
    *) refuse "there is nothing to install for '$purpose'. Known: opengl, vulkan." ;;
    esac
done

missing=()
for package in "${wanted[@]}"; do
    is_new_enough "$package" "$(installed_version "$package")" || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    echo "Nothing to install: ${wanted[*]} are there."
    exit 0
fi
if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null; then
    refuse "Missing: ${missing[*]}. This needs root, and there is no sudo; as root: scripts/install_system_packages.sh"
fi

echo "Installing ${missing[*]} (drawing without a display) with apt-get ..."
release=()
as_root apt-get update -qq
[[ " ${missing[*]} " != *" mesa-vulkan-drivers "* ]] || provide_driver
# The ${...[@]+} form: an empty array is an unset variable to older versions of bash.
as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    ${release[@]+"${release[@]}"} "${missing[@]}"
echo "Installed ${missing[*]}."
