"""`python -m squeal.article.report.screen TABLE.tex`: a generated table as a page of HTML."""

import html
import sys
from pathlib import Path

from squeal.article.report.plain import table_rows

STYLE = (
    "body{font:15px sans-serif}table{border-collapse:collapse}"
    "th,td{padding:3px 10px;text-align:left;vertical-align:top;border-bottom:1px solid #ccc}"
)


def page(tex: str, title: str) -> str:
    """The table with its head, nothing fetched from elsewhere."""
    head, *body = (
        "".join(_cell("td" if i else "th", cell) for cell in row)
        for i, row in enumerate(table_rows(tex))
    )
    lines = "\n".join(f"<tr>{row}</tr>" for row in body)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{html.escape(title)}</title><style>{STYLE}</style></head>\n<body><table>\n"
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{lines}\n</tbody></table></body></html>\n"
    )


def _cell(tag: str, text: str) -> str:
    """A cell; what is short, such as a number with an exponent, stays on one line."""
    return f"<{tag}{' nowrap' if len(text) <= 24 else ''}>{html.escape(text)}</{tag}>"


def main() -> int:
    """Print the page of one table."""
    file = Path(sys.argv[1])
    print(page(file.read_text(encoding="utf-8"), file.stem), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
