"""Every command and every Python block of the documentation is run; every link leads somewhere.

How pages are written, so that they can be run:

- The blocks of a page run in order, in one process and one empty folder. Python blocks share names.
- A `text` block after a `python` or `sh` block is what that prints; `...` stands for anything. A
  Python block without one prints nothing, and warns of nothing.
- A `toml` block whose first line is `# NAME.toml` is written to that file, for a command to use.
- Other languages (`bibtex`, or none) are not looked at.

`python -m tests.test_documentation` writes what is printed now into the `text` blocks.
"""

import doctest
import os
import re
import shlex
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest
from PIL import Image

import qbumpers
from qbumpers.cli import application
from qbumpers.experiments.sources import load_experiment
from tests.narrowing import present

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {
    str(path.relative_to(ROOT)): path
    for path in [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]
}
RUNNING = ("python", "sh")
RUN_LANGUAGES = (*RUNNING, "toml", "text")
OTHERS = "docs/third-party.md"  # needs packages that this one does not
INTERNAL = ("borrowing", "cli", "compilation", "errors", "files", "kept_code", "source")
INTERNAL_PREFIXES = tuple(f"qbumpers.{name}." for name in INTERNAL)
SERVING = {"play"}  # goes on until it is stopped: tests/play runs it
CITED_HOSTS = {"doi.org", "arxiv.org"}
EXAMPLE_HOSTS = {"127.0.0.1", "lab.example.org", "study.example.org"}

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
_NAMED_TOML = re.compile(r"# (\S+\.toml)\n")
_MARK = "--- next block ---"
_PREAMBLE = f"""
import subprocess, sys, warnings
from pathlib import Path

def show_warning(message, category, *_):
    print(f"{{category.__name__}}: {{message}}")

def next_block():
    print({_MARK!r}, flush=True)

def _run_command(*command):
    subprocess.run([sys.executable, "-m", *command], check=True, stderr=subprocess.STDOUT)

warnings.showwarning = show_warning
"""


class Block(NamedTuple):
    language: str
    text: str


def blocks_of(page):
    return [Block(*found) for found in _FENCE.findall(page.read_text(encoding="utf-8"))]


def prose_of(page):
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


def commands_of(blocks):
    lines = [line for b in blocks if b.language == "sh" for line in b.text.splitlines()]
    return [shlex.split(line, comments=True) for line in lines if line.strip()]


def is_run(command):
    """Whether a command is run here; the others are checked by tests of their own."""
    return command[0] == "qbumpers"


def script_of(blocks):
    """The blocks of a page as one Python script that says where each begins."""
    parts = [_PREAMBLE]
    for block in blocks:
        parts.append("next_block()")
        if block.language == "python":
            parts.append(block.text)
        elif block.language == "sh":
            parts += [f"_run_command(*{c!r})" for c in commands_of([block]) if is_run(c)]
        elif named := _NAMED_TOML.match(block.text):
            parts.append(f"Path({named[1]!r}).write_text({block.text!r}, encoding='utf-8')")
    return "\n".join(parts)


def printed_by(blocks, folder, more=""):
    """What each block of a page prints; `more` is a folder with packages of others."""
    script = folder / "page.py"
    script.write_text(script_of(blocks), encoding="utf-8")
    working = folder / "working"
    working.mkdir()
    environment = {**os.environ, "MPLBACKEND": "Agg", "COLUMNS": "110", "PYTHONIOENCODING": "utf-8"}
    if more:
        paths = [os.environ.get("PYTHONPATH", ""), str(more)]
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    finished = subprocess.run(
        [sys.executable, str(script)],
        cwd=working, env=environment, capture_output=True, text=True, encoding="utf-8",
    )  # fmt: skip
    assert finished.returncode == 0, finished.stdout + finished.stderr
    return finished.stdout.split(_MARK + "\n")[1:]


def shown_and_printed(page, folder, more=""):
    """For each block that runs: the `text` block after it or None, itself, and what it prints."""
    found = [m for m in _FENCE.finditer(page.read_text("utf-8")) if m[1] in RUN_LANGUAGES]
    outputs = printed_by([Block(*m.groups()) for m in found], folder, more)
    return [
        (after if after and after[1] == "text" else None, block, printed)
        for block, after, printed in zip(found, [*found, None][1:], outputs, strict=True)
        if block[1] in RUNNING
    ]


def with_blocks():
    return [n for n, p in PAGES.items() if "```" in p.read_text("utf-8") and n != OTHERS]


@pytest.mark.slow
def test_environments_of_other_packages_go_all_the_way_to_a_report(tmp_path):
    packages = tmp_path / "packages"
    names = ["minigrid", "highway-env", "gym-classics", "pygame"]
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", packages, *names],
        check=True,
    )
    check_printed(OTHERS, tmp_path, packages)
    reports = [path.parent.name for path in tmp_path.glob("working/results/*/report.html")]
    assert sorted(reports) == ["empty", "empty-on-ray", "merge", "wind"]
    tables = [
        (tmp_path / "working" / "results" / name / "episodes.parquet").read_bytes()
        for name in ("empty", "empty-on-ray")
    ]
    assert tables[0] == tables[1]


README = "README.md"


@pytest.mark.parametrize(
    "name",
    [n if n == README else pytest.param(n, marks=pytest.mark.documentation) for n in with_blocks()],
)
def test_what_a_page_shows_runs_and_prints_what_it_says(name, tmp_path):
    check_printed(name, tmp_path)


def check_printed(name, folder, more=""):
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    for shown, block, printed in shown_and_printed(PAGES[name], folder, more):
        if shown or block[1] == "python":
            expected = shown[2] if shown else ""
            assert doctest.OutputChecker().check_output(expected, printed, flags), (
                f"{name}: after\n{block[2]}\nis shown\n{expected}\nbut it prints\n{printed}"
            )


@pytest.mark.parametrize("name", PAGES)
def test_the_fences_of_a_page_are_paired_and_of_known_languages(name):
    text = PAGES[name].read_text(encoding="utf-8")
    assert "```" not in prose_of(PAGES[name])
    languages = {block.language for block in blocks_of(PAGES[name])}
    assert languages <= {*RUN_LANGUAGES, "bibtex", "nginx", ""}
    assert text.endswith("\n")


@pytest.mark.parametrize("name", PAGES)
def test_every_shown_command_is_one_that_these_tests_know(name):
    for command in commands_of(blocks_of(PAGES[name])):
        program, *arguments = command
        if program == "make":
            targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
            assert set(arguments) <= set(targets)
        elif program == "pip":
            assert arguments[:2] == ["install", "-e"]
            assert re.fullmatch(r"\.(\[\w+\])?", arguments[2])
            extra = re.findall(r"\w+", arguments[2])
            project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
            assert set(extra) <= set(project["project"]["optional-dependencies"])
        elif program == "python":
            assert (ROOT / arguments[0]).is_file()
        else:
            assert is_run(command), f"{name}: {command} is run by no test"


@pytest.mark.parametrize("name", PAGES)
def test_every_named_experiment_file_is_valid_and_used(name, tmp_path):
    blocks = blocks_of(PAGES[name])
    for block in blocks:
        if block.language != "toml":
            continue
        tomllib.loads(block.text)
        if named := _NAMED_TOML.match(block.text):
            assert any(named[1] in other.text for other in blocks if other.language in RUNNING)
            (tmp_path / named[1]).write_text(block.text, encoding="utf-8")
            # Pages make or install the modules that their files import.
            if name != OTHERS and not tomllib.loads(block.text).get("imports"):
                load_experiment(tmp_path / named[1])


def anchors_of(page):
    """Anchors of a page's headings, as Python-Markdown makes them."""
    headings = re.findall(r"^#+ (.+)$", prose_of(page), re.MULTILINE)
    plain = [re.sub(r"[^\w\s-]", "", heading).strip().lower() for heading in headings]
    return {re.sub(r"[-\s]+", "-", heading) for heading in plain}


@pytest.mark.parametrize("name", PAGES)
def test_links_and_pictures_of_a_page_exist(name):
    page = PAGES[name]
    for found in _LINK.findall(prose_of(page)):
        target, _, anchor = (found[0] or found[1]).partition("#")
        if target.startswith("https://"):
            continue
        path = (page.parent / target).resolve() if target else page
        assert path.is_file(), f"{name}: {target}"
        if anchor:
            assert anchor in anchors_of(path), f"{name}: {target}#{anchor}"


@pytest.mark.parametrize(
    "path",
    [
        path
        for path in [*PAGES.values(), ROOT / "mkdocs.yml", *sorted(DOCS.rglob("*"))]
        if path.suffix in {".md", ".yml", ".css", ".py", ".j2"}
    ],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_no_page_names_a_host_but_those_of_citations_and_examples(path):
    hosts = re.findall(r"(?:https?:)?//([\w-]+(?:\.[\w-]+)+)", path.read_text(encoding="utf-8"))
    assert set(hosts) <= CITED_HOSTS | EXAMPLE_HOSTS


def documented():
    """What the reference describes: modules, or names of modules."""
    pages = sorted((DOCS / "reference").glob("*.md"))
    return {n for p in pages for n in re.findall(r"^::: (\S+)", p.read_text("utf-8"), re.MULTILINE)}


def test_every_public_name_is_in_the_reference():
    for name in set(qbumpers.__all__) - {"__version__"}:
        module = getattr(qbumpers, name).__module__
        assert documented() & {module, f"{module}.{name}"}, f"{name} of {module}"


def test_the_reference_has_every_module_that_is_not_internal():
    modules = {
        ".".join(path.relative_to(ROOT / "src").with_suffix("").parts)
        for path in (ROOT / "src" / "qbumpers").rglob("*.py")
        if not path.name.startswith("__")
    }
    missing = modules - documented()
    assert [m for m in missing if not f"{m}.".startswith(INTERNAL_PREFIXES)] == []


def test_the_contributors_page_shows_the_layers_and_the_folders_that_there_are():
    page = (DOCS / "contributing.md").read_text(encoding="utf-8")
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    assert "\n".join(layer.replace("qbumpers.", "") for layer in layers) in page
    for path in (ROOT / "src" / "qbumpers").iterdir():
        if path.suffix == ".py" and not path.name.startswith("__"):
            assert f"  {path.name} " in page
        elif (path / "__init__.py").is_file():
            assert f"  {path.name}/ " in page


def test_every_command_is_shown_somewhere():
    shown = {c[1] for p in PAGES.values() for c in commands_of(blocks_of(p)) if is_run(c)}
    registered = {c.name or present(c.callback).__name__ for c in application.registered_commands}
    assert registered - SERVING <= shown
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES.values())
    assert all(f"\nqbumpers {name} " in pages for name in SERVING)


def test_pictures_are_small_enough_for_a_repository():
    pictures = sorted((DOCS / "images").glob("*.png"))
    assert pictures
    for path in pictures:
        assert path.stat().st_size < 150_000, path.name
        with Image.open(path) as picture:
            assert picture.width <= 1700, path.name


def make(script, folder):
    subprocess.run([sys.executable, str(DOCS / script), str(folder)], check=True)
    return {path.name for path in (folder / "images").iterdir()}


@pytest.mark.slow
def test_the_reproduction_page_says_what_its_script_finds(tmp_path):
    """The committed page, pictures aside, is exactly what the script writes."""
    pictures = make("make_reproduction.py", tmp_path)
    fresh = (tmp_path / "reproduction.md").read_text(encoding="utf-8")
    assert (DOCS / "reproduction.md").read_text(encoding="utf-8") == fresh
    assert pictures <= {path.name for path in (DOCS / "images").iterdir()}


def test_the_page_on_learner_aware_bumpers_says_what_was_measured(tmp_path):
    pictures = make("make_learner_aware.py", tmp_path)
    assert pictures == {"learner-aware.png", "learner-aware-lander.png"}
    fresh = (tmp_path / "learner-aware.md").read_text(encoding="utf-8")
    assert (DOCS / "learner-aware.md").read_text(encoding="utf-8") == fresh


@pytest.mark.slow
def test_learner_aware_bumpers_can_be_measured_again():
    command = [sys.executable, str(DOCS / "run_learner_aware.py"), "points", "robust", "filter"]
    printed = subprocess.run(
        [*command, "--trials", "2"], capture_output=True, text=True, check=True
    ).stdout
    assert len(re.findall(r"assisted and more than .*: (?:reached|missed)", printed)) == 3
    assert "estimated values" in printed
    assert "Largest regret" in printed
    assert len(re.findall(r"\.\. [+-][0-9.]+  (?:ahead|not behind|open|behind)", printed)) == 6


@pytest.mark.slow
def test_the_page_on_choosing_says_what_the_kept_tables_do(tmp_path):
    """The committed page, pictures aside, is exactly what the script writes."""
    pictures = make("make_comparison.py", tmp_path)
    fresh = (tmp_path / "choosing.md").read_text(encoding="utf-8")
    assert (DOCS / "choosing.md").read_text(encoding="utf-8") == fresh
    assert pictures <= {path.name for path in (DOCS / "images").iterdir()}


@pytest.mark.slow
def test_the_pictures_of_the_ideas_can_be_drawn_again(tmp_path):
    pictures = make("make_pictures.py", tmp_path)
    assert pictures
    assert pictures <= {path.name for path in (DOCS / "images").iterdir()}


def rewrite(page):
    """Write what blocks print into the `text` blocks after them, unless those have `...`."""
    text = page.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        for shown, _, printed in reversed(shown_and_printed(page, Path(folder))):
            if shown and "..." not in shown[2]:
                lines = [line.rstrip() + "\n" for line in printed.splitlines()]
                text = text[: shown.start(2)] + "".join(lines) + text[shown.end(2) :]
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    for one in PAGES.values():
        rewrite(one)
