"""The rules that a reader relies on: layers, sizes, names, docstrings, sources, light imports."""

import ast
import itertools
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from hcpg import registry

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"
MODULES = {path.relative_to(SOURCE).as_posix(): path for path in sorted(SOURCE.rglob("*.py"))}
TREES = {name: ast.parse(path.read_text()) for name, path in MODULES.items()}
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)

LONGEST_FILE = 300
LONGEST_FUNCTION = 50
NAMES_OF_NOTHING = {"base", "common", "helper", "helpers", "misc", "util", "utils"}
# Plug-ins that are named with a plain English word: only the whole identifier or string counts as their name.
ENGLISH_WORDS = {"point", "carry", "reach"}

REFERENCE = re.compile(
    r"\b(?i:(equation|table|figure|algorithm))s? ((?:\(?(?:\d+|[IVX]+)\b\)?(?:, | and | to )?)+)"
)
CODE = re.compile(r"`(hcpg/[\w/]+\.py(?::[\w.]+)?)`")


def definitions(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Every class, function and method by dotted name; nothing that is inside a function."""
    pending = [("", node) for node in tree.body]
    while pending:
        prefix, node = pending.pop()
        if isinstance(node, (ast.ClassDef, *FUNCTIONS)):
            yield prefix + node.name, node
        if isinstance(node, ast.ClassDef):
            pending += [(f"{prefix}{node.name}.", child) for child in node.body]


def documents(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Every docstring with the dotted name of what it documents ("" for the module); a field's too."""
    yield "", ast.get_docstring(tree) or ""
    for name, node in definitions(tree):
        yield name, ast.get_docstring(node) or ""
    scopes = [
        ("", tree),
        *((f"{name}.", node) for name, node in definitions(tree) if isinstance(node, ast.ClassDef)),
    ]
    for prefix, scope in scopes:
        for field, text in itertools.pairwise(scope.body):
            is_text = isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
            if is_text and isinstance(field, (ast.Assign, ast.AnnAssign)):
                target = field.targets[0] if isinstance(field, ast.Assign) else field.target
                yield prefix + ast.unparse(target), str(text.value.value)


def references(text: str) -> set[str]:
    """The paper's items that `text` names, one by one: "equations (5) to (7)" names three."""
    found = set()
    for kind, labels in REFERENCE.findall(text):
        spelt_out = re.sub(r"(\d+)\)? to \(?(\d+)", _count, labels)
        found |= {f"{kind.lower()} {label}" for label in re.findall(r"\d+|[IVX]+", spelt_out)}
    return found


def _count(ends: re.Match[str]) -> str:
    return ", ".join(map(str, range(int(ends[1]), int(ends[2]) + 1)))


def sources(text: str) -> set[str]:
    """The items of the paper (not of other works) in the `Source:` paragraphs of one docstring."""
    paragraphs = re.findall(r"Source:(.*?)(?:\n\s*\n|\Z)", text, re.DOTALL)
    flat = [" ".join(paragraph.split()).partition("Deviation")[0] for paragraph in paragraphs]
    ours = [re.search(r"\bpaper(?:,|'s) (.*)", part) for paragraph in flat for part in paragraph.split(";")]
    return {item for match in ours if match for item in references(match[1])}


def sourced_code() -> set[tuple[str, str]]:
    """Each pair of an item of the paper and the code that names it as its source."""
    return {
        (item, f"{module}:{name}" if name else module)
        for module, tree in TREES.items()
        for name, text in documents(tree)
        for item in sources(text)
    }


def mapped_code() -> set[tuple[str, str]]:
    """The same pairs, as the table in docs/paper_map.md has them."""
    rows = [
        line.split("|")
        for line in (ROOT / "docs/paper_map.md").read_text().splitlines()
        if line.startswith("|")
    ]
    return {(item, code) for row in rows for item in references(row[1]) for code in CODE.findall(row[2])}


def test_every_import_contract_holds():
    settings, cache = str(ROOT / "pyproject.toml"), str(ROOT / ".cache/import_linter")
    # In a process of its own: the linter disables the loggers that other tests listen to.
    code = "from importlinter.cli import lint_imports as lint; "
    code += f"raise SystemExit(lint(config_filename={settings!r}, "
    code += f"cache_dir={cache!r}, no_logo=True))"
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stdout
    assert "6 kept, 0 broken" in answer.stdout


def test_no_file_is_longer_than_300_lines():
    lengths = {name: len(path.read_text().splitlines()) for name, path in MODULES.items()}
    assert {name: length for name, length in lengths.items() if length > LONGEST_FILE} == {}


def test_no_function_is_longer_than_50_lines():
    lengths = {
        f"{module}:{node.name}": node.end_lineno - node.lineno + 1
        for module, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, FUNCTIONS)
    }
    assert {name: length for name, length in lengths.items() if length > LONGEST_FUNCTION} == {}


def test_no_module_turns_its_annotations_into_strings():
    files = [path for folder in ("src", "tests", "scripts") for path in (ROOT / folder).rglob("*.py")]
    assert [
        path.name for path in files if re.search(r"^from __future__", path.read_text(), re.MULTILINE)
    ] == []


def test_no_module_is_named_after_nothing():
    assert [name for name in MODULES if set(Path(name).with_suffix("").parts) & NAMES_OF_NOTHING] == []


def test_everything_public_has_a_docstring():
    bare = [
        f"{module}:{name}"
        for module, tree in TREES.items()
        for name, text in [
            ("", ast.get_docstring(tree)),
            *((n, ast.get_docstring(d)) for n, d in definitions(tree)),
        ]
        if not text and not any(part.startswith("_") for part in name.split("."))
    ]
    assert bare == []


def plugin_names() -> set[str]:
    """Methods, suites, robots and tasks, tasks with and without their suite."""
    tasks = registry.names("tasks")
    short = {name.partition("/")[2] for name in tasks}
    kinds = ("methods", "suites", "robots")
    return {*tasks, *short, *(name for kind in kinds for name in registry.names(kind))}


def test_loops_never_name_a_plugin():
    names = plugin_names()
    assert "sac_flow" in names
    found = []
    for module in (name for name in MODULES if name.startswith("hcpg/loops/")):
        text = MODULES[module].read_text()
        words = {node.id for node in ast.walk(TREES[module]) if isinstance(node, ast.Name)}
        words |= {str(node.value) for node in ast.walk(TREES[module]) if isinstance(node, ast.Constant)}
        for name in names:
            spellings = {name, name.replace("-", "_"), name.replace("/", ".").replace("-", "_")}
            said = any(re.search(rf"(?<![A-Za-z]){re.escape(s)}(?![A-Za-z])", text) for s in spellings)
            found += [(module, name)] if (words & spellings or (said and name not in ENGLISH_WORDS)) else []
    assert found == []


def test_the_paper_map_and_the_sources_agree():
    written, mapped = sourced_code(), mapped_code()
    assert len(written) > 0
    assert sorted(written - mapped) == [], "named by a docstring's Source, missing in docs/paper_map.md"
    assert sorted(mapped - written) == [], "in docs/paper_map.md, named by no docstring's Source"


def test_every_source_stands_in_a_docstring():
    lines = {name: len(re.findall(r"Source: *paper", path.read_text())) for name, path in MODULES.items()}
    parsed = {
        name: sum(len(re.findall(r"Source: *paper", text)) for _, text in documents(tree))
        for name, tree in TREES.items()
    }
    assert parsed == lines


def test_the_map_names_code_that_exists():
    known = {f"{module}:{name}" for module, tree in TREES.items() for name, _ in documents(tree)}
    named = set(CODE.findall((ROOT / "docs/paper_map.md").read_text()))
    assert sorted(named - known - set(MODULES)) == []


def test_references_are_told_apart():
    assert references("equations (5) to (7) and (9)") == {
        "equation 5",
        "equation 6",
        "equation 7",
        "equation 9",
    }
    assert references("Algorithm 1, lines 2 to 7") == {"algorithm 1"}
    assert sources("x\n\nSource: paper, table II and figure 4; SAC-Flow, equation (8).\n\nEquation (9).") == {
        "table II",
        "figure 4",
    }
    assert sources("Source: SAC-Flow, equation (8).") == set()


def test_the_selector_loads_neither_jax_nor_torch_where_they_are_installed():
    code = "import sys, hcpg.selection; print(*{'jax', 'torch', 'numpy'} & set(sys.modules))"
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    loaded = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True)
    assert loaded.split() == ["numpy"]
