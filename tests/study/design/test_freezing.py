"""Freezing: what is frozen is served live, and nothing that differs from it."""

import hashlib
import json

import pytest

from qbumpers.errors import RequestError
from qbumpers.study.design import freezing
from qbumpers.study.design.sources import EXAMPLE, load_study, setups_of


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "study.toml"
    path.write_bytes(EXAMPLE.read_bytes())
    return path


def loaded(file):
    study = load_study(file)
    return file, study, setups_of(study)


def test_the_hash_is_that_of_the_content_and_the_page_shows_it(file):
    digest = freezing.freeze(*loaded(file))
    frozen = json.loads((file.parent / "study.frozen.json").read_text(encoding="utf-8"))
    text = json.dumps(frozen["content"], sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert digest == frozen["hash"] == hashlib.sha256(text.encode()).hexdigest()
    page = (file.parent / "study.frozen.html").read_text(encoding="utf-8")
    for text in (digest, "Welch", "posttest: bumpers against maximal", "You walk from the start"):
        assert text in page
    assert freezing.check_frozen(*loaded(file)) == digest
    assert freezing.freeze(*loaded(file)) == digest  # the same again is no matter


@pytest.mark.parametrize(
    ("before", "now", "message"),
    [
        ("alpha = 0.5", "alpha = 0.6", "conditions was"),
        ("episodes = 3\n", "episodes = 4\n", "parts was"),
        ("seed = 1", "seed = 2", "seed was 1, now 2"),
    ],
)
def test_what_differs_is_named_and_not_served_live(file, before, now, message):
    freezing.freeze(*loaded(file))
    file.write_text(file.read_text(encoding="utf-8").replace(before, now), encoding="utf-8")
    with pytest.raises(RequestError, match=message) as error:
        freezing.check_frozen(*loaded(file))
    assert "only as it was frozen" in str(error.value)
    with pytest.raises(RequestError, match="it was frozen before"):
        freezing.freeze(*loaded(file))


def test_other_code_is_not_served_live(file, monkeypatch):
    freezing.freeze(*loaded(file))
    monkeypatch.setattr(freezing, "code_digest", lambda: "another")
    with pytest.raises(RequestError, match=r"code was .* now 'another'"):
        freezing.check_frozen(*loaded(file))


def test_what_was_changed_by_hand_or_is_missing_is_refused(file):
    with pytest.raises(RequestError, match="freeze the study first"):
        freezing.check_frozen(*loaded(file))
    freezing.freeze(*loaded(file))
    path = freezing.frozen_path(file)
    path.write_text(path.read_text(encoding="utf-8").replace("posttest", "pretest"), "utf-8")
    with pytest.raises(RequestError, match="its hash is not that of its content"):
        freezing.check_frozen(*loaded(file))
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(RequestError, match="it is no frozen study"):
        freezing.check_frozen(*loaded(file))
