"""Excel workbooks, a test per sheet."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError, not_installed
from .raw_table import RawTable, Row, is_data, tables_of_rows


def read_excel(path: Path) -> list[RawTable]:
    """Excel workbooks: a sheet per test (needs the extra excel)."""
    try:
        import openpyxl
    except ModuleNotFoundError:
        raise not_installed(f"{path}:", "openpyxl", "excel") from None
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
        book.close()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except Exception as error:  # openpyxl raises many kinds
        words = " ".join(str(error).split())
        raise InputError(f"{path}: cannot be read ({words}); expected: a workbook *.xlsx") from None
    tables: list[RawTable] = []
    for title, values in sheets.items():
        width = max(map(len, values), default=0)
        rows = []
        for k, row in enumerate(values, 1):
            cells = ["" if cell is None else str(cell).strip() for cell in row]
            cells += [""] * (width - len(cells))
            rows.append(Row(k, cells, is_data(cells)))
        tables += tables_of_rows(path, f"sheet {title}", rows)
    return tables
