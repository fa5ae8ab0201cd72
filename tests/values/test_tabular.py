"""Tables of values: checks, provenance, and files that do not lie about what they hold."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest

import qbumpers
from qbumpers import RequestError, TabularValues, load_values, solve
from qbumpers.tasks import cliff_walking
from qbumpers.values import check_width
from tests.narrowing import of_kind

TABLE = np.array([[1.5, -2.0, 0.0], [4.0, 5.0, 1 / 3]])


def values(**changes) -> TabularValues:
    return TabularValues(
        **{"table": TABLE, "discount": 0.9, "task": "a task", "method": "by hand", **changes}
    )


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "values.npz"
    values().save(path)
    return path


def test_an_observation_is_the_number_of_a_state():
    assert values()(1).tolist() == TABLE[1].tolist()
    assert values()(np.int64(0)).tolist() == TABLE[0].tolist()


def test_a_table_is_copied_and_cannot_be_changed():
    own = TABLE.copy()
    made = values(table=own)
    own[0, 0] = 99.0
    assert made.table[0, 0] == 1.5
    with pytest.raises(ValueError, match="read-only"):
        made.table[0, 0] = 3.0


@pytest.mark.parametrize("shape", [(6,), (1, 2, 3)])
def test_a_table_of_another_rank_is_refused(shape):
    with pytest.raises(RequestError, match=rf"values of a task: table has shape \({shape[0]},"):
        values(table=TABLE.reshape(shape))


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_named(number):
    table = TABLE.copy()
    table[1, 2] = number
    with pytest.raises(RequestError, match=rf"values of a task: Q\(1, 2\) = {number};"):
        values(table=table)


def test_a_file_gives_back_the_values_and_where_they_came_from(saved):
    loaded = of_kind(TabularValues, load_values(saved))
    assert loaded.table.tobytes() == TABLE.tobytes()
    assert (loaded.discount, loaded.task, loaded.method) == (0.9, "a task", "by hand")
    assert loaded.version == qbumpers.__version__
    assert loaded.digest() == values().digest()


def test_a_file_keeps_the_version_that_made_its_values(tmp_path):
    values(version="0.0.1").save(tmp_path / "old.npz")
    assert load_values(tmp_path / "old.npz").version == "0.0.1"


def test_exact_values_survive_a_file_bit_by_bit(tmp_path):
    exact = solve(cliff_walking())
    exact.save(str(tmp_path / "exact.npz"))
    assert load_values(str(tmp_path / "exact.npz")).digest() == exact.digest()


def test_saving_leaves_one_file_under_the_very_name(tmp_path):
    values().save(tmp_path / "named.values")
    values(table=TABLE + 1).save(tmp_path / "named.values")
    assert [path.name for path in tmp_path.iterdir()] == ["named.values"]
    loaded = of_kind(TabularValues, load_values(tmp_path / "named.values"))
    assert loaded.table.tolist() == (TABLE + 1).tolist()


def test_a_failed_write_leaves_the_old_file_and_nothing_else(saved, monkeypatch):
    def fail(*_arguments, **_fields):
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="disk full"):
        values(table=TABLE + 1).save(saved)
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]
    assert load_values(saved).digest() == values().digest()


def test_the_digest_is_of_the_numbers_their_shape_and_the_discount():
    assert values(task="other", method="other").digest() == values().digest()
    changed = [
        values(table=TABLE + np.eye(2, 3) * 1e-12),
        values(table=TABLE.reshape(3, 2)),
        values(discount=1.0),
    ]
    assert len({made.digest() for made in [values(), *changed]}) == 4


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RequestError, match=r"values file .*absent\.npz: there is none"):
        load_values(tmp_path / "absent.npz")


def test_a_folder_is_no_file_of_values(tmp_path):
    with pytest.raises(RequestError, match="not a file of Q values"):
        load_values(tmp_path)


@pytest.mark.parametrize("content", [b"", b"not values", b"PK\x03\x04 nearly an archive"])
def test_another_kind_of_file_is_refused(tmp_path, content):
    path = tmp_path / "values.npz"
    path.write_bytes(content)
    with pytest.raises(RequestError, match=r"values file .*values\.npz: not a file of Q values"):
        load_values(path)


def test_an_array_file_is_refused(tmp_path):
    np.save(tmp_path / "table.npy", TABLE)
    with pytest.raises(RequestError, match="not a file of Q values"):
        load_values(tmp_path / "table.npy")


@pytest.mark.parametrize(
    "content",
    [
        {"table": TABLE},
        {"provenance": "{}"},
        {"table": TABLE, "provenance": "no json"},
        {"table": TABLE, "provenance": "{}"},
        {"table": TABLE, "provenance": '"text"'},
        {"table": TABLE, "provenance": json.dumps({"sha256": "", "surprise": 1})},
    ],
)
def test_an_archive_with_other_contents_is_refused(tmp_path, content):
    np.savez(tmp_path / "other.npz", **content)
    with pytest.raises(RequestError, match="not a file of Q values"):
        load_values(tmp_path / "other.npz")


def test_a_file_of_another_version_that_cannot_be_read_names_it(tmp_path):
    provenance = {"version": "99.0.0", "colour": "red", "sha256": ""}
    np.savez(tmp_path / "new.npz", table=TABLE, provenance=np.array(json.dumps(provenance)))
    with pytest.raises(
        RequestError, match=rf"by qbumpers 99\.0\.0, .* {qbumpers.__version__} .*col"
    ):
        load_values(tmp_path / "new.npz")


@pytest.mark.parametrize("field", ["table", "discount"])
def test_changed_contents_do_not_match_their_hash(saved, field):
    with np.load(saved) as file:
        table, provenance = file["table"], json.loads(str(file["provenance"]))
    if field == "table":
        table[0, 1] += 1e-9
    else:
        provenance["discount"] = 1.0
    np.savez(saved, table=table, provenance=json.dumps(provenance))
    with pytest.raises(RequestError, match="its contents do not match its hash"):
        load_values(saved)


def test_a_truncated_file_is_refused_wherever_it_ends(saved):
    content = saved.read_bytes()
    for length in range(0, len(content), 7):
        saved.write_bytes(content[:length])
        with pytest.raises(RequestError, match=r"values\.npz"):
            load_values(saved)


def test_a_changed_byte_is_refused_or_of_no_consequence(saved):
    content, digest = saved.read_bytes(), values().digest()
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 0xFF
        saved.write_bytes(changed)
        with contextlib.suppress(RequestError):
            assert load_values(saved).digest() == digest


def test_a_row_of_the_right_width_is_copied():
    row = TABLE[0]
    checked = check_width(row, 3, "here")
    checked[0] = 8.0
    assert row[0] == 1.5
    assert check_width([1, 2], 2, "here").dtype == np.float64


@pytest.mark.parametrize("row", [[1.0, 2.0], [1.0] * 4, [[1.0] * 3], 5.0])
def test_a_row_of_another_shape_is_refused(row):
    with pytest.raises(RequestError, match=r"Q values at reset have shape .*\(3,\), is needed"):
        check_width(row, 3, "at reset")


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_a_row_that_is_not_finite_is_refused(number):
    with pytest.raises(RequestError, match=f"Q values after step 4 are .*{number}"):
        check_width([0.0, number, 1.0], 3, "after step 4")


def test_a_finite_row_whose_sum_overflows_is_accepted():
    assert check_width([1e308, 1e308], 2, "here").tolist() == [1e308, 1e308]
