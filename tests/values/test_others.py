"""Further values beside Q*: called like it, and kept in its file under the same hash."""

import json
import pickle

import numpy as np
import pytest

from qbumpers import RequestError, TabularValues, load_values
from qbumpers.networks import Network
from tests.values.networks import network_of

TABLE = np.array([[1.5, -2.0, 0.0], [4.0, 5.0, 1 / 3]])
SAFETY = np.array([[0.1, 0.9, 0.5], [1.0, 0.0, 0.25]])


def table_of(table=TABLE, **fields):
    return TabularValues(table, **{"discount": 0.9, "task": "a task", "method": "hand", **fields})


def tables():
    effort = table_of(TABLE - SAFETY, method="counted", discount=1.0)
    return table_of(others={"safety": SAFETY, "effort": effort})


def networks(**changes):
    return network_of(others={"safety": network_of(seed=7, method="shaped"), **changes})


def test_further_values_are_called_like_the_values_themselves():
    assert tables().others["safety"](1).tolist() == SAFETY[1].tolist()
    assert tables().others["effort"](0).tolist() == (TABLE - SAFETY)[0].tolist()
    observation = np.array([0.5, -1.0, 2.0])
    expected = network_of(seed=7)(observation)
    assert networks().others["safety"](observation).tolist() == expected.tolist()


@pytest.mark.parametrize("make", [tables, networks])
def test_they_travel_with_the_values_through_files_and_processes(tmp_path, make):
    values = make()
    values.save(tmp_path / "values.npz")
    loaded = load_values(tmp_path / "values.npz")
    for copied in (loaded, pickle.loads(pickle.dumps(values))):
        assert copied.digest() == values.digest()
        assert list(copied.others) == list(values.others)
        for name, further in values.others.items():
            found = copied.others[name]
            assert found.digest() == further.digest()
            assert (found.method, found.discount) == (further.method, further.discount)


@pytest.mark.parametrize(
    ("plain", "digest", "names"),
    [
        (
            table_of(), "2f97fe25", ["table", "provenance"],
        ),
        (
            network_of(), "26fe92d9",
            [f"{layer}.{part}" for layer in ("hidden_1", "hidden_2", "values")
             for part in ("weight", "bias")] + ["provenance"],
        ),
    ],
)  # fmt: skip
def test_values_without_them_are_and_are_kept_as_they_were(tmp_path, plain, digest, names):
    assert plain.digest()[:8] == digest
    plain.save(tmp_path / "values.npz")
    with np.load(tmp_path / "values.npz") as file:
        assert file.files == names
        assert "others" not in json.loads(str(file["provenance"]))


def test_the_digest_is_of_further_values_and_their_names():
    others = [{}, {"safety": SAFETY}, {"safety": SAFETY + 1e-12}, {"effort": SAFETY}]
    assert len({table_of(others=each).digest() for each in others}) == 4
    turned = table_of(others={"effort": TABLE, "safety": SAFETY})
    assert turned.digest() == table_of(others={"safety": SAFETY, "effort": TABLE}).digest()


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ({"safety": SAFETY.T}, r"others\['safety'\] has the shape \(3, 2\); \(2, 3\)"),
        ({"not safe": SAFETY}, r"others\['not safe'\]: the name must be one word"),
        ({"a.b": SAFETY}, "must be one word"),
        ({"safety": 5}, "is a int; TabularValues are needed"),
        ({"safety": network_of()}, "is a NetworkValues; TabularValues are needed"),
        ({"safety": tables()}, "further values of its own"),
        ({"safety": np.full((2, 3), np.nan)}, "every value must be finite"),
    ],
)
def test_further_tables_that_do_not_suit_are_named(others, message):
    with pytest.raises(RequestError, match=rf"values of a task: .*{message}"):
        table_of(others=others)


@pytest.mark.parametrize(
    "shape",
    [{"network": Network((5, 3))}, {"network": Network((5, 4), "relu")}, {"inputs": 4}],
    ids=str,
)
def test_a_further_network_of_another_shape_is_refused(shape):
    with pytest.raises(RequestError, match=r"others\['effort'\] has the shape Layout.*is needed"):
        networks(effort=network_of(**shape))


def change_a_number(arrays, provenance):
    arrays["others.safety.table"] = arrays["others.safety.table"] + 1e-12


def drop_an_array(arrays, provenance):
    del arrays["others.safety.table"]


def drop_their_origin(arrays, provenance):
    del provenance["others"]


def change_their_discount(arrays, provenance):
    provenance["others"]["safety"]["discount"] = 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (change_a_number, "do not match its hash"),
        (change_their_discount, "do not match its hash"),
        (drop_an_array, r"further values \['effort'\] and the provenance of"),
        (drop_their_origin, r"further values \['effort', 'safety'\] and the provenance of \[\]"),
    ],
)
def test_a_file_whose_further_values_were_changed_is_refused(tmp_path, change, message):
    path = tmp_path / "values.npz"
    tables().save(path)
    with np.load(path) as file:
        arrays = dict(file.items())
    provenance = json.loads(str(arrays.pop("provenance")))
    change(arrays, provenance)
    np.savez(path, **arrays, provenance=json.dumps(provenance))
    with pytest.raises(RequestError, match=message):
        load_values(path)
