"""What is published of the package: citation, description, versions, and what make offers."""

import importlib.util
import re
import subprocess
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

import qbumpers

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def trying():
    """The script that tries what was built."""
    spec = importlib.util.spec_from_file_location("try_dist", ROOT / ".ci" / "try_dist.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_citation_is_of_this_version_and_of_the_paper_that_the_readme_cites():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert citation["version"] == qbumpers.__version__
    assert (citation["license"], citation["type"]) == (PROJECT["project"]["license"], "software")
    assert citation["authors"][0]["name"] in (ROOT / "LICENSE").read_text(encoding="utf-8")
    [paper] = citation["references"]
    assert f"title     = {{{paper['title']}}}" in README
    assert f"year      = {{{paper['year']}}}" in README
    names = " and ".join(f"{a['family-names']}, {a['given-names']}" for a in paper["authors"])
    assert f"author    = {{{names}}}" in README


def test_the_published_description_has_no_links_that_lead_nowhere(trying):
    hook = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    page = README
    assert trying.RELATIVE.search(page), "the page of the repository has links to its files"
    for each in hook["substitutions"]:
        page = re.sub(each["pattern"], each["replacement"], page)
    assert not trying.RELATIVE.search(page)
    assert "![" not in page
    for text in ("# Q Bumpers", "- Quickstart: install, reproduce", "gymnasium.make(", "MIT, see"):
        assert text in page


def test_the_versions_of_python_that_are_claimed_are_those_that_the_pages_name(trying):
    said = " ".join(PROJECT["project"]["classifiers"])
    versions = re.findall(r"Python :: (3\.\d+)", said)
    assert PROJECT["project"]["requires-python"] == f">={versions[0]}"
    assert versions[0] == ".".join(map(str, trying.OLDEST))
    page = (ROOT / "docs" / "quickstart.md").read_text(encoding="utf-8")
    assert f"{', '.join(versions[:-1])} and {versions[-1]} are tried" in page


def packed(folder, extra_in_wheel=(), extra_in_sources=(), missing=()):
    """Distributions as they should be, but for some files."""
    wheel, sources = folder / "q.whl", folder / "q.tar.gz"
    files = [p for p in (ROOT / "src" / "qbumpers").rglob("*") if p.is_file()]
    names = [p.relative_to(ROOT / "src").as_posix() for p in files if "__pycache__" not in str(p)]
    with zipfile.ZipFile(wheel, "w") as archive:
        for name in {*names, *extra_in_wheel} - {*missing}:
            archive.writestr(name, "")
        archive.writestr("q.dist-info/METADATA", "Name: q\n\nA page.\n")
    with tarfile.open(sources, "w:gz") as archive:
        for name in ("pyproject.toml", "README.md", *extra_in_sources):
            archive.add(ROOT / "LICENSE", f"q-1/{name}")
    return wheel, sources


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"missing": ["qbumpers/py.typed"]}, r"q\.whl: differs .*py\.typed"),
        ({"extra_in_wheel": ["qbumpers/left.pyc"]}, r"q\.whl: differs .*left\.pyc"),
        ({"extra_in_sources": ["site/index.html"]}, r"q\.tar\.gz: holds .*site/index\.html"),
        ({"extra_in_sources": ["src/__pycache__/a.pyc"]}, r"q\.tar\.gz: holds .*a\.pyc"),
    ],
)
def test_distributions_with_too_little_or_too_much_are_refused(trying, tmp_path, changes, message):
    trying.check_contents(*packed(tmp_path))
    with pytest.raises(SystemExit, match=message):
        trying.check_contents(*packed(tmp_path, **changes))


def test_the_newest_python_of_each_minor_version_is_tried(trying):
    found = trying.pythons()
    assert found, "the Python of the tests themselves is one"
    minors = [version.rpartition(".")[0] for version in found]
    assert len(set(minors)) == len(minors)
    assert all(tuple(map(int, version.split(".")))[:2] >= trying.OLDEST for version in found)


def test_make_shows_everything_that_there_is_to_make():
    shown = subprocess.run(
        ["make", "--no-print-directory", "help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    [offered] = re.findall(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)
    lines = [line.split(maxsplit=2) for line in shown.stdout.splitlines()]
    assert [line[1] for line in lines] == offered.split()
    assert all(line[0] == "make" and len(line) == 3 for line in lines)
