"""Cores that may be used: those of the machine, of the process and of its control group."""

import os
import subprocess
import sys

import pytest

from qbumpers import cores
from qbumpers.experiments.local import ThisMachine


@pytest.fixture
def group(tmp_path, monkeypatch):
    """Write the limits of a process's control group and of the group around it."""
    groups, mounted = tmp_path / "cgroup", tmp_path / "mounted"
    inner = mounted / "pod" / "job"
    inner.mkdir(parents=True)
    groups.write_text("1:cpu:/old\n0::/pod/job\n")
    monkeypatch.setattr(cores, "_GROUPS", groups)
    monkeypatch.setattr(cores, "_MOUNTED", mounted)
    monkeypatch.setattr(cores, "_allowed", lambda: 8)

    def limit(own, around="max 100000"):
        (inner / "cpu.max").write_text(f"{own}\n")
        (inner.parent / "cpu.max").write_text(f"{around}\n")
        return cores.usable_cores()

    return limit


@pytest.mark.parametrize(
    ("own", "around", "usable"),
    [
        ("max 100000", "max 100000", 8),
        ("200000 100000", "max 100000", 2),
        ("max 100000", "300000 100000", 3),
        ("600000 100000", "400000 100000", 4),
        ("150000 100000", "max 100000", 2),
        ("1000 100000", "max 100000", 1),
        ("6400000 100000", "max 100000", 8),
        ("not a quota", "max 100000", 8),
    ],
)
def test_the_smallest_quota_of_all_groups_counts(group, own, around, usable):
    assert group(own, around) == usable
    assert ThisMachine().cores == usable


def test_without_control_groups_the_cores_of_the_process_count(group, tmp_path):
    group("100000 100000")
    (tmp_path / "cgroup").unlink()
    assert cores.usable_cores() == 8


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux pins processes to cores here")
def test_a_pinned_process_uses_its_own_cores_only():
    core = min(os.sched_getaffinity(0))
    program = (
        f"import os; os.sched_setaffinity(0, {{{core}}})\n"
        "from qbumpers.cores import usable_cores; print(usable_cores())"
    )
    finished = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert finished.stdout.strip() == "1"
