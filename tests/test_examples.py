"""The examples run as they are, from the first line to the last."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))
NEEDED = {
    "lunar_lander.py": "Box2D",
    "train_inside_with_stable_baselines3.py": "stable_baselines3",
}
PRINTED = {
    "lunar_lander.py": (
        r"unassisted: crashed after \d+ steps, return -\d+\.\d, 0 overrides; see \S+\.gif\n"
        r"bumpers: \w+ after \d+ steps, return -?\d+\.\d, \d+ overrides; see \S+\.gif\n"
        r"maximal: landed after \d+ steps, return \d+\.\d, \d+ overrides; see \S+\.gif\n"
    ),
    "train_inside_with_stable_baselines3.py": (
        r"before training: mean return -?\d+\.\d, \d+\.\d overrides per episode\n"
        r"after training: mean return -?\d+\.\d, \d+\.\d overrides per episode\n"
    ),
}


@pytest.mark.documentation
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_prints(example, tmp_path):
    if example.name in NEEDED:
        pytest.importorskip(NEEDED[example.name])
    finished = subprocess.run(
        [sys.executable, str(example)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert finished.returncode == 0, finished.stderr
    assert re.fullmatch(PRINTED.get(example.name, r"(?s).*\S.*"), finished.stdout)


def test_there_are_examples():
    assert EXAMPLES
