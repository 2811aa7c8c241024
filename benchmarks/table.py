"""Tables of figures as Markdown that is also read easily as plain text."""

from collections.abc import Sequence

Cell = str | int | float


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """Title, header and rows as Markdown: first column left-aligned, others right-aligned, floats with two decimals."""
    lines = [[str(c) for c in columns], *([_text(cell) for cell in row] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(columns))]
    body = [
        " | ".join(
            cell.rjust(width) if k else cell.ljust(width) for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    ]
    rule = "|".join("-" * (width + 1) + ("-" if k == 0 else ":") for k, width in enumerate(widths))
    return "\n".join(["", f"**{title}**", "", f"| {body[0]} |", f"|{rule}|", *(f"| {line} |" for line in body[1:])])


def _text(cell: Cell) -> str:
    return f"{cell:.2f}" if isinstance(cell, float) else str(cell)
