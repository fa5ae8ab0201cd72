"""Rules that Numba cannot compile decide the same in plain Python; what is no rule is refused."""

import functools
import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from qbumpers import RequestError, make_assistant, register_assistant, simulate
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks import cliff_walking
from tests.assistants.own_rules import NoOptions, guide
from tests.assistants.situations import situation_of

pytestmark = pytest.mark.usefixtures("own_registry")

NOISE = Noise(0.5, 0.5)
SITUATIONS = [situation_of([1.0, 3.0, 2.0, 0.0], proposed) for proposed in range(4)]


def with_an_import(situation, noise, options):
    import math

    return Decision(guide(situation, noise, options).action, math.ceil(0.5) * 1.0)


def with_a_format(situation, noise, options):
    words = f"{situation.values.argmax():02d}"
    return Decision(int(words), 1.0)


def with_an_exception(situation, noise, options):
    try:
        return Decision([1][situation.proposed] * 1, 1.0)
    except IndexError as error:
        return Decision(len(error.args), 1.0)


def with_a_generator(situation, noise, options):
    best = max(value for value in situation.values)
    return Decision(next(a for a in range(4) if situation.values[a] == best), 1.0)


def with_a_dictionary_of_lists(situation, noise, options):
    places: dict[float, list[int]] = {}
    for action, value in enumerate(situation.values.tolist()):
        places.setdefault(value, []).append(action)
    return Decision(places[max(places)][0], 1.0)


seen: list[int] = []
count = 0


def with_a_global_list(situation, noise, options):
    seen.append(situation.proposed)
    return Decision(int(situation.values.argmax()), 1.0)


def with_a_global_number(situation, noise, options):
    global count
    count += 1
    return Decision(int(situation.values.argmax()), 1.0)


def with_any_arguments(*arguments):
    return Decision(int(arguments[0].values.argmax()), 1.0)


def with_a_named_argument(situation, noise, options, *, factor=1.0):
    return Decision(int(situation.values.argmax()), factor)


def with_an_argument_before(factor, situation, noise, options):
    return Decision(int(situation.values.argmax()), factor)


class Callable:
    def __call__(self, situation, noise, options):
        return Decision(int(situation.values.argmax()), 1.0)


PLAIN = [
    with_an_import, with_a_format, with_an_exception, with_a_generator,
    with_a_dictionary_of_lists, with_a_global_list, with_a_global_number, with_any_arguments,
    with_a_named_argument, functools.partial(with_an_argument_before, 1.0), Callable(),
    Callable().__call__, lambda situation, noise, options: with_a_format(situation, noise, options),
]  # fmt: skip


def name_of(rule):
    return getattr(rule, "__name__", type(rule).__name__)


@pytest.mark.parametrize("rule", PLAIN, ids=name_of)
def test_a_rule_that_cannot_be_compiled_runs_as_plain_python_with_one_warning(rule):
    with pytest.warns(UserWarning, match="'own' cannot be compiled and will run as plain") as said:
        register_assistant("own", NoOptions)(rule)
    assert len(said) == 1
    assert said[0].filename == __file__
    assistant = make_assistant("own")
    assert not assistant.rule.compiled
    assert [assistant.decide(each, NOISE).action for each in SITUATIONS] == [1, 1, 1, 1]


class Listed(NamedTuple):
    actions: list[int] = [1, 3]  # noqa: RUF012 - as users write it
    words: str = "listed"
    most: float | None = None


def listed(situation, noise, options):
    most = math.inf if options.most is None else options.most
    allowed = situation.proposed in options.actions and situation.values[0] < most
    return Decision(situation.proposed if allowed else options.actions[0], float(not allowed))


def test_options_that_compiled_code_does_not_take_reach_a_plain_rule_as_they_are():
    with pytest.warns(UserWarning, match=r"no settings of the type list\[int\]"):
        register_assistant("listed", Listed)(listed)
    assistant = make_assistant("listed", actions=[2], words="two")
    assert [assistant.decide(each, NOISE).action for each in SITUATIONS] == [2, 2, 2, 2]
    found = simulate(cliff_walking(), assistant, trials=1, episodes=2)
    assert (found.outcomes.assisted_length == 100).all()  # whoever only goes down never arrives


class Untyped(NamedTuple):
    numbers: Any = np.zeros(2)


def test_options_that_results_cannot_name_are_refused_before_anything_runs():
    with pytest.warns(UserWarning, match="no settings of the type"):
        register_assistant("untyped", Untyped)(guide)
    assistant = make_assistant("untyped")
    assert assistant.decide(SITUATIONS[0], NOISE).probability == 1
    with pytest.raises(RequestError, match=r"options of assistant untyped: numbers = array.*Files"):
        simulate(cliff_walking(), assistant, trials=1)


@pytest.mark.parametrize(
    ("rule", "what"),
    [
        (lambda situation, noise, options: situation.proposed, "int64"),
        (lambda situation, noise, options: None, "none"),
        (lambda situation, noise, options: (situation.proposed, 0.0), r"Tuple\(int64, float64\)"),
    ],
)
def test_a_compiled_rule_that_decides_nothing_is_refused_when_it_is_registered(rule, what):
    with pytest.raises(RequestError, match=rf"assistant 'own': it returns {what}.*not a Decision"):
        register_assistant("own", NoOptions)(rule)


@pytest.mark.parametrize(
    "found",
    [3, None, (3, 0.0), (3,), Decision("up", 0.0), Decision(1, "often")],  # type: ignore[arg-type]
)
def test_a_plain_rule_that_decides_nothing_is_named(found):
    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("own", NoOptions)(lambda *_: found)
    assistant = make_assistant("own")
    message = r"assistant own: its rule returns .*; a Decision is needed"
    with pytest.raises(RequestError, match=message):
        assistant.decide(SITUATIONS[0], NOISE)
    with pytest.raises(RequestError, match=message):
        simulate(cliff_walking(), assistant, trials=1, episodes=1)


def at_times(situation, noise, options) -> Any:
    if situation.proposed != 2:
        return Decision(situation.proposed, 0.0)
    return None


def test_a_rule_that_does_not_always_decide_runs_as_plain_python_until_it_does_not():
    with pytest.warns(UserWarning, match="not always a Decision"):
        register_assistant("own", NoOptions)(at_times)
    assistant = make_assistant("own")
    assert assistant.decide(SITUATIONS[1], NOISE) == Decision(1, 0.0)
    with pytest.raises(RequestError, match="its rule returns None"):
        assistant.decide(SITUATIONS[2], NOISE)


def remember(memory, step, options):
    return memory


class Named(NamedTuple):
    name: float = 0.0


def test_an_option_cannot_be_called_as_the_rule_is():
    with pytest.raises(RequestError, match="'own': an option cannot be called 'name'"):
        register_assistant("own", Named)


WRONG_ARGUMENTS = {
    "too few": (lambda situation, noise: 0, {}, r"rule 'own' takes \(situation, noise\)"),
    "too many": (lambda a, b, c, d: 0, {}, r"'own' takes \(a, b, c, d\)"),
    "none": (lambda: 0, {}, r"'own' takes \(\)"),
    "no function": (5, {}, "'own' is 5; a function of"),
    "no memory": (
        guide,
        {"start": lambda options, model: 0, "observe": remember},
        r"is called with \(situation, noise, options, memory\)",
    ),
    "observe": (
        guide,
        {"start": lambda options, model: 0, "observe": lambda memory: memory},
        r"'own': observe takes \(memory\); it is called with \(memory, step, options\)",
    ),
    "start": (guide, {"start": 0, "observe": remember}, "start is 0; a function of"),
    "check_start": (
        guide,
        {"check_start": lambda options: None},
        r"check_start takes \(options\); it is called with \(options, start_value\)",
    ),
}


@pytest.mark.parametrize(
    ("rule", "others", "message"), WRONG_ARGUMENTS.values(), ids=list(WRONG_ARGUMENTS)
)
def test_functions_of_other_arguments_are_refused_when_they_are_registered(rule, others, message):
    with pytest.raises(RequestError, match=message):
        register_assistant("own", NoOptions, **others)(rule)
