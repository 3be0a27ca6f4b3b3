# SPDX-License-Identifier: MIT
"""Figures in pages: a table's row begins with the figure's name."""

import pathlib
import re


def stale(page, name, column, reached):
    """What is wrong with the figure in this column (from 1) of the row `name`; "" = nothing. It must not be below what was
    reached, nor more than 5 % above."""
    row = re.search(rf"^\| {re.escape(name)} \|(.*)\|$", pathlib.Path(page).read_text(), re.MULTILINE)
    shown = row and row[1].split("|")[column - 1].strip().replace(",", "")
    if shown and shown.isdecimal() and reached <= int(shown) <= reached * 1.05:
        return ""
    return f"{page}: {name}: it says {shown or 'nothing'}, and it is {reached}"
