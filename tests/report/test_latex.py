"""The LaTeX tables compile, and the page shows their numbers."""

import shutil
import subprocess

import pytest

from hcpg.report import ablation_tables, paper_tables
from hcpg.report.provenance import provenance, signed
from hcpg.report.records import load_runs

DOCUMENT = r"""\documentclass{article}
\usepackage{booktabs}
\begin{document}
%s
\end{document}
"""


def has_booktabs():
    asked = ["kpsewhich", "booktabs.sty"]
    return shutil.which("pdflatex") is not None and subprocess.run(asked, capture_output=True).returncode == 0


@pytest.mark.skipif(not has_booktabs(), reason="needs pdflatex and booktabs (texlive-latex-recommended)")
def test_every_table_compiles_and_shows_its_numbers(write_run, tmp_path):
    for preset, successes in {"sac_flow": 5, "hcpg_k2": 7, "hcpg_flow": 9}.items():
        for seed in (0, 1):
            success = [successes - seed] * 5
            write_run(preset=preset, seed=seed, task="maniskill/pick-cube", success=success, bare=[0] * 5)
            write_run(preset=preset, seed=seed, task="my/odd_task", success=success, bare=[0] * 5)
    groups = load_runs([tmp_path])
    texts = {
        "table.tex": paper_tables.latex(paper_tables.main_table(groups)),
        **ablation_tables.files(groups),
    }
    origin = provenance(groups, "hcpg report 50 % of_all & more")
    tables = [signed(name, text, origin) for name, text in texts.items() if name.endswith(".tex")]
    assert len(tables) == 3
    (tmp_path / "page.tex").write_text(DOCUMENT % "\n\n".join(tables))
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "page.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Output written on page.pdf (1 page" in done.stdout
    assert "Overfull" not in done.stdout
