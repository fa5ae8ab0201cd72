"""`qbumpers play` and `qbumpers study` say what is wrong before anything starts."""

import sqlite3

import pytest

pytest.importorskip("starlette", reason="the extra study is not installed")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["cliff-waking"], "unknown task 'cliff-waking' (did you mean 'cliff-walking'?)"),
        (["cliff-walking", "--assistant", "bumper"], "unknown assistant 'bumper'"),
        (["cliff-walking", "--alpha", "2"], "alpha = 2.0: input should be less than or equal to 1"),
        (["cliff-walking", "--p-max", "0.9"], "alpha: field required"),
        (["cliff-walking", "--alpha", "0.5", "--beta", "1"], "unknown option"),
        (["cliff-walking", "stray"], "argument 'stray': an option of the assistant begins with --"),
        (["mountain-car"], "v_min = 0 must be below the value of the start state"),
        (["cliff-walking", "--port", "99999"], "port = 99999"),
        (["cliff-walking", "--host", "192.0.2.1"], "host = 192.0.2.1: that is another address"),
        (["cliff-walking", "--behind-proxy", "example.org"], "behind-proxy = 'example.org'; a URL"),
        (["cliff-walking", "--records", "a.sqlite"], "records = 'a.sqlite'; postgresql://USER@HO"),
        (["cliff-walking", "--records", "mysql://me@there/x"], "records of mysql://: a file, or p"),
        (
            ["cliff-walking", "--assistant", "trajectory-bumpers", "--path=a.csv", "--reach=1"],
            "input should be a valid tuple",
        ),
    ],
)
def test_a_wrong_request_is_refused_in_one_line(call, tmp_path, arguments, message):
    status, _, errors = call("play", *arguments, "--out", str(tmp_path), "--no-browser")
    assert status == 2
    assert message in errors
    assert errors.startswith("error: ")
    assert "\n" not in errors


def test_options_of_a_rule_over_a_rule_are_written_as_in_files(call, tmp_path, monkeypatch):
    from qbumpers.play import running

    found = []
    monkeypatch.setattr(running, "play", lambda setup, choice, *_, **__: found.append(choice))
    arguments = ["--assistant", "fading", "--half-life", "3"]
    nested = '{ name = "hard-bumpers", alpha = 0.2, second = true }'
    assert call("play", "cliff-walking", *arguments, "--of", nested)[0] == 0
    assert call("play", "cliff-walking", *arguments, "--of=maximal")[0] == 0
    assert found[0].options == {
        "half_life": 3, "of": {"name": "hard-bumpers", "alpha": 0.2, "second": True},
    }  # fmt: skip
    assert found[1].options["of"] == "maximal"


@pytest.mark.parametrize(
    ("arguments", "options"),
    [
        (["--alpha", "0.5", "--v-min", "-200"], {"alpha": 0.5, "v_min": -200}),
        (
            ["--v-min=-200", "--second", "--alpha=0.5"],
            {"alpha": 0.5, "v_min": -200, "second": True},
        ),
    ],
)
def test_every_way_to_write_an_option_is_understood(call, monkeypatch, arguments, options):
    from qbumpers.play import running
    from qbumpers.play.game import Choice, Game
    from qbumpers.play.setup import Setup

    found = []
    monkeypatch.setattr(running, "play", lambda setup, choice, *_, **__: found.append(choice))
    assert call("play", "mountain-car", *arguments)[0] == 0
    assert found == [Choice("stochastic-q-bumpers", options)]
    Game(Setup("mountain-car"), 0).begin(found[0])


def test_a_record_that_is_not_there_cannot_be_replayed(call, tmp_path):
    status, _, errors = call("study", "replay", str(tmp_path / "absent.sqlite"))
    assert (status, errors.startswith("error: records file")) == (2, True)


def test_a_record_is_checked_without_a_page(call, tmp_path):
    from qbumpers.play.game import Choice
    from qbumpers.play.setup import Setup
    from tests.play.recording import record

    path = tmp_path / "play.sqlite"
    record(Setup("cliff-walking"), path, [(Choice("none", {}), [0, 1])])
    assert call("study", "replay", str(path), "--check") == (
        0, "one cliff-walking: 1 episode, 2 steps: OK", ""
    )  # fmt: skip
    raw = sqlite3.connect(path)
    raw.execute("update steps set reward = 3 where number = 1")
    raw.commit()
    raw.close()
    status, output, _ = call("study", "replay", str(path), "--check", "--session", "one")
    assert status == 1
    assert "different: step 1 (episode 0): reward is -1.0, recorded 3.0" in output
    status, _, errors = call("study", "replay", str(path), "--session", "two")
    assert (status, errors) == (2, "error: session = 'two': the record has ['one']")


def test_a_record_without_sessions_has_no_page(call, tmp_path):
    from qbumpers.play.tables import open_records

    path = tmp_path / "play.sqlite"
    open_records(path).dispose()
    assert call("study", "replay", str(path), "--check")[0] == 0
    status, _, errors = call("study", "replay", str(path))
    assert (status, "it has no session to be shown" in errors) == (2, True)
