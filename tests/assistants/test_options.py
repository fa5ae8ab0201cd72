"""Options of own rules: tuples, texts and files; what registration refuses."""

from typing import Literal, NamedTuple

import numpy as np
import pytest

from qbumpers import RequestError, make_assistant, register_assistant
from qbumpers.decisions import Decision, Noise
from qbumpers.registration import File
from tests.assistants.own_rules import BudgetOptions as OwnBudget
from tests.assistants.own_rules import NoOptions, full_budget, guide_within_budget, spend
from tests.assistants.situations import situation_of

pytestmark = pytest.mark.usefixtures("own_registry")

NOISE = Noise(0.5, 0.5)
TABLE = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


class ManyOptions(NamedTuple):
    table: File
    weights: tuple[float, float]
    mode: Literal["soft", "firm", "hard"] = "firm"


def add_up(situation, noise, options):
    """A sum that tells every option, in place of a probability."""
    number = options.table[1, situation.proposed] + 10 * options.weights[1] + 1000 * options.mode
    return Decision(situation.proposed, number)


def made(path, weights=(2.0, 3.0), **options):
    register_assistant("add-up", ManyOptions)(add_up)
    return make_assistant("add-up", table=str(path), weights=weights, **options)


@pytest.fixture(params=["npy", "csv"])
def path(request, tmp_path):
    name = tmp_path / f"table.{request.param}"
    np.save(name, TABLE) if request.param == "npy" else np.savetxt(name, TABLE, delimiter=",")
    return name


@pytest.mark.parametrize(("mode", "place"), [("soft", 0), ("firm", 1), ("hard", 2)])
def test_files_tuples_and_texts_reach_the_rule_as_numbers(path, mode, place):
    assistant = made(path, mode=mode)
    assert assistant.rule.compiled
    found = assistant.rule.decide(situation_of([0.0] * 3, 2), NOISE, assistant.numbers)  # compiled
    assert found.probability == 6.0 + 30.0 + 1000 * place
    assert assistant.decide(situation_of([0.0] * 3, 0), NOISE).probability == 34 + 1000 * place


def test_lists_are_taken_as_tuples(path):
    assert made(path, weights=[2, 3]).options.weights == (2.0, 3.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weights": (1.0,)}, "weights"),
        ({"weights": (1.0, 2.0, 3.0)}, "weights"),
        ({"weights": (1.0, "much")}, "weights.*much"),
        ({"mode": "gentle"}, "mode = 'gentle'.*'soft', 'firm' or 'hard'"),
    ],
)
def test_wrong_tuples_and_texts_are_refused(path, options, message):
    with pytest.raises(RequestError, match=f"assistant add-up: {message}"):
        made(path, **options)


def test_files_that_hold_no_finite_numbers_are_refused(tmp_path):
    with pytest.raises(RequestError, match=r"table = '.*missing\.npy': .*No such file"):
        made(tmp_path / "missing.npy")
    with pytest.raises(RequestError, match=r"table = '.*missing\.csv': .*No such file"):
        made(tmp_path / "missing.csv")
    words = tmp_path / "words.csv"
    words.write_text("up,down\n")
    with pytest.raises(RequestError, match=r"words\.csv': not a .npy or .csv file of numbers"):
        made(words)
    for name in ("empty.npy", "empty.csv"):
        (tmp_path / name).touch()
        with pytest.raises(RequestError, match=rf"{name}': not a .npy or .csv file of numbers"):
            made(tmp_path / name)
    for value in (np.nan, np.inf):
        np.save(tmp_path / "broken.npy", np.array([[1.0, value]]))
        with pytest.raises(RequestError, match=r"broken\.npy': every number in it must be finite"):
            made(tmp_path / "broken.npy")


def test_a_table_that_begins_with_a_mark_of_its_encoding_is_read(path):
    marked = path.with_name("marked.csv")
    marked.write_bytes(b"\xef\xbb\xbf1,2,3\r\n4,5,6\r\n")
    assert np.array_equal(made(marked).numbers.table, TABLE)


def mind_the_order(situation, noise, options):
    _values, proposed, _earned, _discount, _start_value = situation
    return Decision(proposed, 0.0)


def by_position(situation):
    _values, proposed, _earned, _discount, _start_value = situation
    return proposed


def unpack_elsewhere(situation, noise, options):
    return Decision({"proposed": by_position(situation)}["proposed"], 0.0)


def test_a_rule_that_unpacks_a_situation_is_told_to_read_names():
    with pytest.raises(RequestError, match=r"'own'.*by position; read them by name"):
        register_assistant("own", NoOptions)(mind_the_order)


def test_a_rule_in_plain_python_that_unpacks_a_situation_is_told_too():
    with pytest.warns(UserWarning, match="'own' cannot be compiled"):
        register_assistant("own", NoOptions)(unpack_elsewhere)
    with pytest.raises(RequestError, match=r"assistant own: .*by position; read them by name"):
        make_assistant("own").decide(situation_of([1.0, 2.0], 0), NOISE)


def test_start_takes_the_model_too():
    with pytest.raises(RequestError, match=r"start takes \(options\); .* \(options, model\)"):
        register_assistant("own", OwnBudget, start=lambda options: 0, observe=spend)


def test_an_unknown_need_names_the_nearest():
    with pytest.raises(RequestError, match=r"'dynamic'.*did you mean 'dynamics'"):
        register_assistant("own", OwnBudget, start=full_budget, observe=spend, needs=("dynamic",))(
            guide_within_budget
        )
