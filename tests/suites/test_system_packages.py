"""The installer of what draws pictures, on machines that a few stand-ins for its commands make up."""

import shutil
import subprocess
from pathlib import Path

import pytest

INSTALLER = Path(__file__).parents[2] / "scripts/install_system_packages.sh"
SAPIEN, OPENGL = "libx11-6 libgl1 libglib2.0-0", "libegl1 libgl1-mesa-dri"
VULKAN = "libvulkan1 mesa-vulkan-drivers"
BACKPORTED = "25.0.7-2~bpo12+1"


class Machine:
    """What is installed and offered; `run` gives the process and the calls of apt-get so far."""

    def __init__(self, folder, *, root=True, offered="22.3.6-1", codename="bookworm"):
        self.folder, self.installed = folder, {}
        (folder / "os-release").write_text(f"ID=any\nVERSION_CODENAME={codename}\n")
        self.sources = folder / "sources"
        self.sources.mkdir()
        self.stand_in("apt-get", f'echo "$*" >>{folder}/calls')
        self.stand_in("apt-cache", f"echo '  Installed: (none)'; echo '  Candidate: {offered}'")
        self.stand_in("dpkg", '[ "${2%%.*}" -ge "$4" ]')
        self.stand_in("id", f"echo {0 if root else 1000}")
        self.stand_in("env", 'shift; exec "$@"')
        for name in ("sed", "grep", "tee"):
            (folder / name).symlink_to(shutil.which(name))

    def stand_in(self, name, body):
        (self.folder / name).write_text(f"#!/bin/bash\n{body}\n")
        (self.folder / name).chmod(0o755)

    def run(self, *arguments):
        cases = "".join(f"{name}) echo 'installed {self.installed[name]}';; " for name in self.installed)
        self.stand_in("dpkg-query", f'case "$3" in {cases} *) exit 1;; esac')
        places = {"APT_SOURCES": str(self.sources), "OS_RELEASE": str(self.folder / "os-release")}
        told = subprocess.run(
            ["/bin/bash", INSTALLER, *arguments],
            env={"PATH": str(self.folder), **places},
            capture_output=True,
            text=True,
            check=False,
        )
        calls = self.folder / "calls"
        return told, calls.read_text().splitlines() if calls.exists() else []


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


def test_what_is_missing_for_one_purpose_is_installed_and_then_nothing(machine):
    machine.installed = {"libegl1": "1.6"}
    told, calls = machine.run("opengl")
    assert told.returncode == 0
    assert calls == ["update -qq", "install -y -qq --no-install-recommends libgl1-mesa-dri"]
    assert "Installing libgl1-mesa-dri" in told.stdout
    machine.installed["libgl1-mesa-dri"] = "22.3.6"
    told, again = machine.run("opengl")
    assert told.returncode == 0
    assert told.stdout == f"Nothing to install: {OPENGL} are there.\n"
    assert again == calls


def test_debian_twelve_gets_the_vulkan_driver_from_its_backports(machine):
    machine.installed = dict.fromkeys([*SAPIEN.split(), *OPENGL.split()], "22.3.6")
    told, calls = machine.run()
    assert told.returncode == 0
    install = f"install -y -qq --no-install-recommends -t bookworm-backports {VULKAN}"
    assert calls == ["update -qq", "update -qq", install]
    (source,) = machine.sources.iterdir()
    assert source.read_text().endswith(" http://deb.debian.org/debian bookworm-backports main\n")


def test_a_package_under_its_newer_name_is_there(machine):
    machine.installed = {"libx11-6": "2:1.8", "libgl1": "1.7", "libglib2.0-0t64": "2.80"}
    told, calls = machine.run("sapien")
    assert told.stdout == f"Nothing to install: {SAPIEN} are there.\n"
    assert calls == []


def test_a_driver_that_sapien_refuses_counts_as_missing_and_a_newer_one_as_there(machine):
    machine.installed = {"libvulkan1": "1.3", "mesa-vulkan-drivers": "22.3.6-1"}
    _, calls = machine.run("vulkan")
    assert calls[-1].endswith("-t bookworm-backports mesa-vulkan-drivers")
    machine.installed["mesa-vulkan-drivers"] = BACKPORTED
    told, again = machine.run("vulkan")
    assert told.stdout == f"Nothing to install: {VULKAN} are there.\n"
    assert again == calls


def test_a_system_that_offers_a_new_enough_driver_needs_no_other_source(tmp_path):
    machine = Machine(tmp_path, offered="25.2.8-0ubuntu1", codename="noble")
    told, calls = machine.run("vulkan")
    assert told.returncode == 0
    assert calls == ["update -qq", f"install -y -qq --no-install-recommends {VULKAN}"]
    assert list(machine.sources.iterdir()) == []


def test_an_older_system_is_told_that_none_fits(tmp_path):
    machine = Machine(tmp_path, offered="23.2.1-1ubuntu3", codename="jammy")
    told, calls = machine.run("vulkan")
    assert told.returncode == 1
    assert "24 or newer, and this system offers 23.2.1-1ubuntu3." in told.stderr
    assert calls == ["update -qq"]


def test_it_says_what_it_cannot_do_without_root(tmp_path):
    machine = Machine(tmp_path, root=False)
    told, calls = machine.run()
    assert told.returncode == 1
    assert told.stderr.startswith(
        f"Missing: {SAPIEN} {OPENGL} {VULKAN}. This needs root, and there is no sudo"
    )
    assert calls == []


def test_sudo_is_used_where_it_is_there(tmp_path):
    machine = Machine(tmp_path, root=False, offered="25.0", codename="trixie")
    machine.stand_in("sudo", f'echo "sudo $*" >>{tmp_path}/calls')
    told, calls = machine.run("vulkan")
    assert told.returncode == 0
    assert calls[0] == "sudo apt-get update -qq"
    assert calls[1].endswith(f"apt-get install -y -qq --no-install-recommends {VULKAN}")
    assert len(calls) == 2


def test_an_unknown_purpose_and_another_system_are_told(machine):
    told, _ = machine.run("metal")
    assert told.stderr == "there is nothing to install for 'metal'. Known: sapien, opengl, vulkan, browser.\n"
    (machine.folder / "apt-get").unlink()
    told, _ = machine.run()
    assert told.returncode == 1
    assert "This is no Debian or Ubuntu" in told.stderr
    assert "lavapipe (24 or newer)" in told.stderr
