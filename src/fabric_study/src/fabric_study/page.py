# SPDX-License-Identifier: BSD-3-Clause
"""HTML files that stand by themselves: the frame of a page, tables, figures, paragraphs."""

import html
from collections.abc import Iterable, Sequence

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>
body {{ font: 15px/1.5 sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }}
h2 {{ margin-top: 2.5rem; border-bottom: 2px solid #333; }} h3 {{ margin-top: 1.8rem; }}
table {{ border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums;
  min-width: 36rem; }}
caption {{ text-align: left; padding-bottom: .3rem; }} figcaption {{ margin-top: .3rem; }}
caption, figcaption {{ font-size: 14px; color: #333; max-width: 60rem; }}
th, td {{ padding: .2rem .7rem; border-bottom: 1px solid #ddd; text-align: right; }}
th {{ vertical-align: bottom; border-bottom: 1px solid #333; }}
th:first-child, td:first-child {{ text-align: left; }}
.words th, .words td {{ text-align: left; vertical-align: top; }}
.words td:first-child, .tests td:first-child {{ min-width: 9rem; }}
.tests th, .tests td {{ padding: .2rem .5rem; vertical-align: top; }} .tests {{ font-size: 13px; }}
tr.group td {{ border-top: 2px solid #999; }}
.wide {{ overflow-x: auto; font-size: 12px; }} svg {{ max-width: 100%; height: auto; }}
figure {{ margin: 1.2rem 0; }} .note {{ color: #444; font-size: 14px; max-width: 60rem; }}
.banner {{ background: #fff3cd; border: 2px solid #b58900;
  padding: .6rem 1rem; font-weight: bold; }}
@page {{ size: A4 landscape; margin: 12mm; }}
@media print {{ body {{ margin: 0; max-width: none; font-size: 12px; }} .wide {{ font-size: 8px; }}
h2, h3 {{ break-after: avoid; }} figure, tr {{ break-inside: avoid; }}
.tests {{ font-size: 11px; }} }}
</style></head><body><h1>{title}</h1>
{body}
</body></html>
"""


def html_page(title: str, body: Iterable[str]) -> str:
    """Return the page; the title is escaped, the parts of the body are HTML."""
    return PAGE.format(title=html.escape(title), body="\n".join(body))


def html_table(lines: Sequence[Iterable[str]], name: str = "", caption: str = "") -> str:
    """Return lines of cells, header first, as a table; cells and caption are escaped.

    name: class of the table. A line whose first cell is empty continues the group above it.
    """
    rows = [f"<caption>{html.escape(caption)}</caption>"] if caption else []
    grouped = any(not next(iter(line), "") for line in lines[1:])
    for number, line in enumerate(lines):
        tag = "td" if number else "th"
        cells = [html.escape(cell) for cell in line]
        group = ' class="group"' if grouped and number and cells[0] else ""
        rows.append(f"<tr{group}>" + "".join(f"<{tag}>{cell}</{tag}>" for cell in cells) + "</tr>")
    return f'<div class="{name}"><table>{"".join(rows)}</table></div>'


def html_figure(svg: str, caption: str) -> str:
    """Return a picture (SVG text) with its escaped caption."""
    return f"<figure>{svg}<figcaption>{html.escape(caption)}</figcaption></figure>"


def paragraph(text: str, name: str = "") -> str:
    """Return an escaped paragraph of this class."""
    attribute = f' class="{name}"' if name else ""
    return f"<p{attribute}>{html.escape(text)}</p>"


def heading(text: str, level: int = 2) -> str:
    """Return an escaped heading."""
    return f"<h{level}>{html.escape(text)}</h{level}>"


def bullets(lines: Iterable[str]) -> str:
    """Return an escaped list."""
    return "<ul>" + "".join(f"<li>{html.escape(line)}</li>" for line in lines) + "</ul>"
