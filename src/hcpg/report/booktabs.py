r"""LaTeX tables with booktabs rules; a document that takes one in needs \usepackage{booktabs}."""

from collections.abc import Sequence

_SPECIAL = {"_": r"\_", "%": r"\%", "&": r"\&", "#": r"\#"}


def booktabs(head: Sequence[str], blocks: Sequence[Sequence[Sequence[str]]], note: str) -> str:
    """A tabular with a rule between blocks of rows; the first column is left, the others are centred.

    Cells may hold LaTeX, but `_`, `%`, `&` and `#` stand for themselves; `note` becomes a comment.
    """
    lines = [f"% {note}", rf"\begin{{tabular}}{{l{'c' * (len(head) - 1)}}}", r"  \toprule", f"  {_row(head)}"]
    for block in blocks:
        lines += [r"  \midrule", *(f"  {_row(row)}" for row in block)]
    return "\n".join([*lines, r"  \bottomrule", r"\end{tabular}"]) + "\n"


def _row(cells: Sequence[str]) -> str:
    return " & ".join("".join(_SPECIAL.get(letter, letter) for letter in cell) for cell in cells) + r" \\"
