"""The rules of Psych-DS 0.4, read from its specification; nothing here knows how data are written.

A data set has `dataset_description.json` at its top, in UTF-8, a JSON-LD object of schema.org with
`@context`, `@type` "Dataset", `name`, `description` and `variableMeasured`. Its data are CSV files
under `data/`, in UTF-8, named by pairs `keyword-value` of letters and digits that underscores join,
before `_data.csv`. Each has a row of column names, no name twice, and as many cells in every row.
Every column of every file is in `variableMeasured`, by its name or as an object with `name`; and
nothing else is.
"""

import csv
import json
import re

NAME = re.compile(r"([a-z]+-[A-Za-z0-9]+)(_[a-z]+-[A-Za-z0-9]+)*_data\.csv")
REQUIRED = ("@context", "@type", "name", "description", "variableMeasured")


def violations(folder):
    """What is wrong with a folder, in sentences; nothing if it is a Psych-DS data set."""
    found = []
    description = read_description(folder, found)
    columns = set()
    files = sorted(folder.glob("data/**/*"))
    if not [file for file in files if file.suffix == ".csv"]:
        found.append("data: no CSV file")
    for file in files:
        if file.is_file():
            columns |= read_columns(file, found)
    measured = names_in(description.get("variableMeasured", []), found)
    found += [f"column {name} is not in variableMeasured" for name in sorted(columns - measured)]
    found += [f"variable {name} is no column" for name in sorted(measured - columns)]
    return found


def read_description(folder, found):
    path = folder / "dataset_description.json"
    try:
        description = json.loads(path.read_bytes().decode("utf-8"))
    except (OSError, ValueError) as error:
        found.append(f"dataset_description.json: {type(error).__name__}")
        return {}
    for field in REQUIRED:
        if not description.get(field):
            found.append(f"{field} is missing")
    if "schema.org" not in str(description.get("@context")):
        found.append("@context is not schema.org")
    if description.get("@type") != "Dataset":
        found.append("@type is not Dataset")
    return description


def names_in(variables, found):
    names = [each["name"] if isinstance(each, dict) else each for each in variables]
    if len(set(names)) < len(names):
        found.append("a variable is described twice")
    return set(names)


def read_columns(file, found):
    if NAME.fullmatch(file.name) is None:
        found.append(f"{file.name}: wrong name")
        return set()
    try:
        text = file.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        found.append(f"{file.name}: not UTF-8")
        return set()
    rows = list(csv.reader(text.splitlines()))
    if len(rows) < 2:
        found.append(f"{file.name}: no rows")
        return set()
    if len(set(rows[0])) < len(rows[0]) or not all(rows[0]):
        found.append(f"{file.name}: column names are not unique")
    if any(len(row) != len(rows[0]) for row in rows):
        found.append(f"{file.name}: rows of several lengths")
    return set(rows[0])
