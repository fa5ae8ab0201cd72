"""A study's data as a Psych-DS folder: CSV files, and a description of every column."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import qbumpers
from qbumpers.files import write_atomically
from qbumpers.study.design.models import Study
from qbumpers.study.outcomes.tables import Column, Table

DESCRIPTION = "dataset_description.json"
"""File that describes the folder."""


def write_dataset(folder: Path, study: Study, tables: Sequence[Table], digest: str) -> None:
    """Write a study's data as a Psych-DS folder.

    Args:
        folder: of the data set.
        study: that they are of.
        tables: of its data; those without rows are left out.
        digest: of the study, frozen or not.

    Raises:
        StoreError: if a file cannot be written.
    """
    filled = [table for table in tables if table.rows]
    names = {f"{_file_name(study, table)}": _as_csv(table) for table in filled}
    for path in (folder / "data").glob("*_data.csv"):
        if path.name not in names:
            path.unlink()
    for name, text in names.items():
        _write(folder / "data" / name, text)
    _write(folder / DESCRIPTION, json.dumps(_described(study, filled, digest), indent=1) + "\n")
    _write(folder / "README.md", _readme(study, filled, digest))


def _write(path: Path, text: str) -> None:
    write_atomically(
        path, lambda temporary: temporary.write_text(text, encoding="utf-8", newline="")
    )


def _file_name(study: Study, table: Table) -> str:
    return f"study-{study.name.replace('-', '')}_description-{table.name}_data.csv"


def _as_csv(table: Table) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([column.name for column in table.columns])
    for row in table.rows:
        writer.writerow([_cell(row[column.name]) for column in table.columns])
    return buffer.getvalue()


def _cell(value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return value


def _described(study: Study, tables: Sequence[Table], digest: str) -> dict[str, Any]:
    columns: dict[str, Column] = {c.name: c for table in tables for c in table.columns}
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": study.title,
        "description": f"Data of the study {study.name}, exported by qbumpers.",
        "schemaVersion": "Psych-DS 0.4.0",
        "identifier": f"sha256:{digest}",
        "version": qbumpers.__version__,
        "inLanguage": study.language,
        "variableMeasured": [_variable(column) for column in columns.values()],
    }


def _variable(column: Column) -> Mapping[str, str]:
    found = {"@type": "PropertyValue", "name": column.name, "description": column.description}
    return {**found, "unitText": column.unit} if column.unit else found


def _readme(study: Study, tables: Sequence[Table], digest: str) -> str:
    """The data dictionary, to be read."""
    lines = [
        f"# {study.title}",
        "",
        f"Data of the study `{study.name}`; SHA-256 of the study: `{digest}`.",
        "Participants have identifiers that the study made up.",
    ]
    for table in tables:
        lines += ["", f"## {_file_name(study, table)}", "", f"{table.description}.", ""]
        lines += ["| column | what it holds | unit |", "|---|---|---|"]
        lines += [
            f"| {column.name} | {column.description} | {column.unit} |" for column in table.columns
        ]
    return "\n".join(lines) + "\n"
