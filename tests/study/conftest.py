"""Without the extra `study`, there are no studies."""

from tests.play.conftest import MISSING

if MISSING:
    collect_ignore_glob = ["test_*.py", "*/test_*.py"]
