"""Entries of the compiler's cache are shared between processes, and never torn."""

import os
import subprocess
import sys
import time

from hcpg.loops.compiled_programs import LEFT_BEHIND_S, CompiledPrograms, open_programs, shared_folder

PROGRAM = """
import os
from hcpg.loops.compiled_programs import open_programs
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
programs = open_programs(os.environ)
import jax
jax.jit(lambda x: x * 2 + 1)(3.0).block_until_ready()
print(programs.publish())
programs.close()
"""


def test_a_second_process_compiles_nothing_anew(tmp_path):
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    del environment["JAX_COMPILATION_CACHE_DIR"]
    command = [sys.executable, "-W", "error", "-c", PROGRAM]
    compiled = [int(subprocess.check_output(command, env=environment, text=True)) for _ in range(2)]
    assert compiled[0] >= 1
    assert compiled[1] == 0


def test_an_entry_is_shared_once_it_is_published(tmp_path):
    first, second = CompiledPrograms(tmp_path), CompiledPrograms(tmp_path)
    (first.path / "program-cache").write_bytes(b"code")
    assert not (tmp_path / "program-cache").exists()
    assert (first.publish(), first.publish()) == (1, 0)
    assert (tmp_path / "program-cache").read_bytes() == b"code"
    (second.path / "program-cache").write_bytes(b"code")
    second.close()
    first.close()
    assert [path.name for path in tmp_path.iterdir()] == ["program-cache"]
    assert (CompiledPrograms(tmp_path).path / "program-cache").read_bytes() == b"code"


def test_what_a_killed_process_left_is_swept_after_a_week(tmp_path):
    young, old = CompiledPrograms(tmp_path), CompiledPrograms(tmp_path)
    then = time.time() - LEFT_BEHIND_S - 60
    os.utime(old.path, (then, then))
    CompiledPrograms(tmp_path)
    assert (young.path.exists(), old.path.exists()) == (True, False)


def test_the_users_own_folder_and_an_unusable_home_are_left_alone(tmp_path):
    assert open_programs({"JAX_COMPILATION_CACHE_DIR": str(tmp_path)}) is None
    (tmp_path / "file").touch()
    assert open_programs({"HOME": str(tmp_path / "file")}) is None
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_folder_is_the_users_cache():
    assert str(shared_folder({"HOME": "/home/ada"})).startswith("/home/ada/.cache/hcpg-flow/compiled/")
    assert str(shared_folder({"XDG_CACHE_HOME": "/big"})).startswith("/big/hcpg-flow/compiled/")
