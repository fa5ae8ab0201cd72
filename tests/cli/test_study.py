"""`qbumpers study` for studies with participants."""

import importlib.util

import pytest

if importlib.util.find_spec("starlette") is None:
    pytest.skip("the extra study is not installed", allow_module_level=True)


@pytest.fixture
def file(tmp_path, call):
    path = tmp_path / "study.toml"
    assert call("study", "new", str(path))[0] == 0
    text = path.read_text(encoding="utf-8")
    for before, now in [("step_limit = 60", "step_limit = 3"), ("episodes = 8 ", "episodes = 1 "),
                        ("drop_out = 0.05", "drop_out = 0.0")]:  # fmt: skip
        text = text.replace(before, now)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_study_from_its_file_to_forgetting(file, tmp_path, call):
    out, exported = str(tmp_path / "records"), tmp_path / "exported"
    status, said, _ = call("study", "check", str(file))
    assert (status, said.splitlines()[-1]) == (0, "OK")
    status, said, _ = call("study", "simulate", str(file), "--participants", "3", "--out", out)
    assert status == 0, said
    assert "complete: 3 participants" in said
    to = ["--mode", "simulated", "--folder", out, "--out", str(exported)]
    status, said, _ = call("study", "export", str(file), *to)
    assert (status, "3 complete ones for: qbumpers report" in said) == (0, True)
    [table] = (exported / "dataset" / "data").glob("*participants_data.csv")
    participant = table.read_text(encoding="utf-8").splitlines()[1].partition(",")[0]
    where = ["--mode", "simulated", "--out", out]
    for condition, message in [
        ("bumpers", "weights: assisted episodes of 1 participant; at least 2 are needed"),
        ("bumper", "unknown condition 'bumper' (did you mean 'bumpers'?)"),
    ]:
        arguments = ["--condition", condition, "--alpha", "0.4", *where]
        status, _, error = call("study", "estimate", str(file), *arguments)
        assert (status, message in error) == (2, True), error
    status, said, _ = call("study", "forget", str(file), participant, *where)
    assert (status, f"written anew without them: {exported}" in said) == (0, True)
    assert participant not in table.read_text(encoding="utf-8")
    status, _, error = call("study", "power", str(file), *where)
    assert (status, "at least 8 each are needed" in error) == (2, True)


def test_what_is_wrong_is_said_in_one_line(file, tmp_path, call):
    out = ["--out", str(tmp_path / "records")]
    for arguments, message in [
        (["new", str(file)], "it is there already"),
        (["serve", str(file), "--live", *out], "freeze the study first"),
        (["forget", str(file), *out], "give the ID of a participant, or --identities"),
        (["forget", str(file), "x", *out], "serve or simulate the study first"),
        (["estimate", str(file), "--condition", "bumpers", *out], "serve or simulate the study"),
        (["reconcile", str(file), "none.csv", *out], "serve or simulate the study first"),
        (["backup", str(file), str(tmp_path / "b"), *out], "there is no such file"),
        (["check", str(tmp_path / "no.toml")], "No such file"),
    ]:
        status, _, error = call("study", *arguments)
        assert (status, message in error) == (2, True), (arguments, error)


def test_freezing_says_the_hash(file, call):
    status, said, _ = call("study", "freeze", str(file))
    assert status == 0
    assert (file.parent / "study.frozen.json").is_file()
    assert "SHA-256" in said
