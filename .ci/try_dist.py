"""Try a built distribution as its users will: `python .ci/try_dist.py dist`.

Looks at what is in it, installs the wheel into a fresh environment of every Python here that it is
made for, runs a small demo from there, outside the checkout, and opens the page of play.
"""

import concurrent.futures
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
import zipfile
from email.parser import BytesParser
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OLDEST = (3, 11)
IN_SOURCES = {
    "src", "pyproject.toml", "README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "PKG-INFO",
    ".gitignore",
}  # fmt: skip
GENERATED = re.compile(r"(^|/)(__pycache__|\.[a-z_]+_cache)(/|$)|\.(pyc|nbi|nbc)$")
RELATIVE = re.compile(r"\]\((?!https?://|#)[^)]*\)")
PAGE = ("", "static/main.js", "static/style.css", "static/uplot/uPlot.esm.js")
DEMO = ("reproduce", "cliff-walking", "--trials", "1", "--alphas", "0.5", "--out", "demo")

_VERSION = "import ensurepip, sys, sysconfig; print(*sys.version_info[:3], sys.executable)"


def main() -> None:
    """Look at both distributions and try the wheel; exit with a message if anything is wrong."""
    folder = Path(sys.argv[1]).resolve()
    [wheel], [sources] = folder.glob("*.whl"), folder.glob("*.tar.gz")
    check_contents(wheel, sources)
    promised = claimed(wheel)
    found = {v: path for v, path in pythons().items() if v.rpartition(".")[0] in promised}
    if not found:
        sys.exit(f"no Python {', '.join(promised)} with ensurepip is here")
    print(f"{wheel.name}: trying Python {', '.join(found)}", flush=True)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        problems = pool.map(partial(tried, wheel), found.values())
        for version, problem in zip(found, problems, strict=True):
            print(f"Python {version}: {problem or 'installed, demo run, page served'}", flush=True)
            if problem:
                sys.exit(1)
    untried = [each for each in promised if each not in {v.rpartition(".")[0] for v in found}]
    if untried:
        print(f"claimed, but not here to be tried: Python {', '.join(untried)}")


def check_contents(wheel: Path, sources: Path) -> None:
    """Exit unless the distributions hold the package, all of it, and nothing else."""
    here = ROOT / "src"
    needed = {
        path.relative_to(here).as_posix()
        for path in (here / "qbumpers").rglob("*")
        if path.is_file() and not GENERATED.search(path.relative_to(here).as_posix())
    }
    packed = set(zipfile.ZipFile(wheel).namelist())
    difference = needed ^ {name for name in packed if name.startswith("qbumpers/")}
    if difference:
        sys.exit(f"{wheel.name}: differs from src in {sorted(difference)}")
    with tarfile.open(sources) as archive:
        names = [name.partition("/")[2] for name in archive.getnames()]
    more = sorted(n for n in names if n.partition("/")[0] not in IN_SOURCES or GENERATED.search(n))
    if more:
        sys.exit(f"{sources.name}: holds {more}")
    page = str(metadata(wheel).get_payload())
    if links := RELATIVE.findall(page):
        sys.exit(f"{wheel.name}: its description has links that lead nowhere: {links}")


def metadata(wheel: Path):
    """What a wheel says of itself."""
    with zipfile.ZipFile(wheel) as archive:
        [name] = [n for n in archive.namelist() if n.endswith(".dist-info/METADATA")]
        return BytesParser().parsebytes(archive.read(name))


def claimed(wheel: Path) -> list[str]:
    """Versions of Python that a wheel says it is for, as "3.12"."""
    classifiers = metadata(wheel).get_all("Classifier", [])
    return [v for c in classifiers if (v := c.rpartition(" :: ")[2]).startswith("3.")]


def pythons() -> dict[str, str]:
    """Path of the newest Python of each minor version from the oldest on, by its version."""
    home = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    places = [sys.executable, *sorted(map(str, home.glob("versions/3.*/bin/python")))]
    places += [path for n in range(OLDEST[1], 30) if (path := shutil.which(f"python3.{n}"))]
    found: dict[tuple[int, ...], str] = {}
    for place in places:
        said = subprocess.run([place, "-c", _VERSION], capture_output=True, text=True)
        if said.returncode == 0:
            *numbers, path = said.stdout.split(maxsplit=3)
            version = tuple(map(int, numbers))
            if version[:2] >= OLDEST:
                found.setdefault(version, path.strip())
    newest = {version[:2]: version for version in sorted(found)}
    return {".".join(map(str, each)): found[each] for each in newest.values()}


def tried(wheel: Path, python: str) -> str:
    """Install a wheel into a fresh environment and run the demo; what went wrong, or nothing."""
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "NUMBA_"))}
    with tempfile.TemporaryDirectory() as place:
        own = f"{place}/own/bin/"
        for command in (
            [python, "-m", "venv", f"{place}/own"],
            [own + "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)],
            [own + "pip", "check"],
            [own + "python", "-c", "import qbumpers; assert '/own/' in qbumpers.__file__"],
            [own + "qbumpers", *DEMO],
            [own + "pip", "install", "--quiet", "--disable-pip-version-check", f"{wheel}[study]"],
        ):
            done = subprocess.run(command, cwd=place, env=inherited, capture_output=True, text=True)
            if done.returncode:
                return f"{' '.join(command)} failed:\n{done.stdout}\n{done.stderr}"
        if not Path(place, "demo", "report.html").is_file():
            return "the demo wrote no report"
        return served(own, place, inherited)


def served(own: str, place: str, environment: dict[str, str]) -> str:
    """Open the page of play; what is not there, or nothing."""
    with subprocess.Popen(
        [own + "qbumpers", "play", "cliff-walking", "--no-browser", "--port", "0"],
        cwd=place, env={**environment, "PYTHONUNBUFFERED": "1"}, stdout=subprocess.PIPE, text=True,
    ) as server:  # fmt: skip
        try:
            assert server.stdout is not None
            said = server.stdout.readline()
            address = re.search(r"http://\S+/", said)
            if address is None:
                return f"play began with {said!r}"
            for part in PAGE:
                with urllib.request.urlopen(address[0] + part, timeout=30) as answer:
                    if not answer.read():
                        return f"play serves an empty {part or 'page'}"
        except OSError as error:
            return f"play does not serve its page: {error}"
        finally:
            server.terminate()
    return ""


if __name__ == "__main__":
    main()
