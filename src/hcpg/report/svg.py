"""The few shapes a drawn diagram needs, as SVG text."""

from html import escape

PAPER, INK, MUTED = "#FFFFFF", "#22272F", "#667080"
Number = int | float
Point = tuple[Number, Number]


def document(width: Number, height: Number, title: str, shapes: list[str]) -> str:
    """A complete SVG file on white, with arrow heads for `arrow`."""
    heads = "".join(
        f'<marker id="{_head(color)}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="5" markerHeight="5" '
        f'orient="auto-start-reverse"><path d="M0 0L8 4L0 8z" fill="{color}"/></marker>'
        for color in sorted({part.split('"')[0] for part in "".join(shapes).split('data-head="')[1:]})
    )
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
        f'height="{height:g}" font-family="Helvetica, Arial, Liberation Sans, DejaVu Sans, sans-serif">',
        f"<title>{escape(title)}</title>",
        f"<defs>{heads}</defs>",
        f'<rect width="{width:g}" height="{height:g}" fill="{PAPER}"/>',
        *shapes,
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def box(corner: Point, size: Point, fill: str, edge: str = INK, thick: Number = 1.5) -> str:
    """A rectangle with round corners."""
    return (
        f'<rect x="{corner[0]:g}" y="{corner[1]:g}" width="{size[0]:g}" height="{size[1]:g}" rx="8" '
        f'fill="{fill}" stroke="{edge}" stroke-width="{thick:g}"/>'
    )


def text(
    at: Point, words: str, size: Number = 15, color: str = INK, anchor: str = "middle", style: str = ""
) -> str:
    """One line of text on the baseline `at`; `style` holds words of CSS's `font`: bold, italic."""
    weight = ' font-weight="bold"' if "bold" in style else ""
    slant = ' font-style="italic"' if "italic" in style else ""
    return (
        f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" font-size="{size:g}" fill="{color}" text-anchor="{anchor}"'
        f"{weight}{slant}>{escape(words)}</text>"
    )


def arrow(points: list[Point], color: str = INK, thick: Number = 1.8, dashes: str = "") -> str:
    """A line through `points` with a head at its end."""
    path = " ".join(f"{'L' if place else 'M'}{x:.1f} {y:.1f}" for place, (x, y) in enumerate(points))
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (
        f'<path d="{path}" fill="none" stroke="{color}" stroke-width="{thick:.2f}"{dashed} '
        f'stroke-linejoin="round" marker-end="url(#{_head(color)})" data-head="{color}"/>'
    )


def bar(corner: Point, size: Point, fill: str) -> str:
    """A plain rectangle."""
    (left, top), (width, height) = corner, size
    return f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}"/>'


def dot(at: Point, radius: Number, fill: str, edge: str = "none") -> str:
    """A disc."""
    return f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:g}" fill="{fill}" stroke="{edge}"/>'


def _head(color: str) -> str:
    return f"head{color.removeprefix('#')}"
