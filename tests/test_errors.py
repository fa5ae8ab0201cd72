"""Error messages: what was given, what is known, what is nearest."""

from typing import Annotated

import pytest
from pydantic import BaseModel, Field, ValidationError, field_validator

from qbumpers.errors import RequestError, counted, from_validation, suggestion, unknown_name


class Trial(BaseModel):
    episodes: Annotated[int, Field(ge=1)]
    share: Annotated[float, Field(le=1)] = 0.5


class Plan(BaseModel):
    trials: list[Trial]


class Walk(BaseModel):
    task: str
    steps: int = 3

    @field_validator("task")
    @classmethod
    def _known(cls, task: str) -> str:
        if task != "cliff":
            raise unknown_name("task", task, ["cliff"])
        return task

    @field_validator("steps")
    @classmethod
    def _odd(cls, steps: int) -> int:
        if steps % 2 == 0:
            raise ValueError("an odd number is needed")
        return steps


def refused(model: type[BaseModel], content: dict) -> str:
    with pytest.raises(ValidationError) as caught:
        model.model_validate(content)
    error = from_validation(caught.value, "plan a.toml")
    assert isinstance(error, RequestError)
    return str(error)


def test_a_request_error_is_a_value_error():
    assert issubclass(RequestError, ValueError)


def test_an_unknown_name_is_told_with_the_nearest_and_all_known():
    error = unknown_name("assistant", "maximul", ["none", "maximal"])
    assert isinstance(error, RequestError)
    message = str(error)
    assert message.startswith("unknown assistant 'maximul'")
    assert "did you mean 'maximal'?" in message
    assert message.endswith("Known: none, maximal")


def test_a_name_like_no_other_gets_no_suggestion():
    message = str(unknown_name("task", "zzz", ["none", "maximal"]))
    assert message == "unknown task 'zzz'. Known: none, maximal"


def test_names_may_come_from_any_iterable():
    assert "did you mean 'b1'?" in str(unknown_name("task", "b2", iter(["b1"])))


def test_where_nothing_is_known_it_says_so():
    assert str(unknown_name("option", "alpha", [])).endswith("Known: there are none")


def test_a_validation_error_names_the_field_the_value_and_the_bound():
    message = refused(Trial, {"episodes": 0})
    assert message.startswith("plan a.toml: episodes = 0: ")
    assert "greater than or equal to 1" in message


def test_every_problem_is_told_at_once():
    message = refused(Trial, {"episodes": 0, "share": 2.5})
    assert "episodes = 0: " in message
    assert "share = 2.5: " in message


def test_a_missing_field_has_no_value_to_show():
    message = refused(Trial, {})
    assert message.lower() == "plan a.toml: episodes: field required"


def test_a_field_inside_others_is_found_by_its_path():
    message = refused(Plan, {"trials": [{"episodes": 3}, {"episodes": -2}]})
    assert "trials.1.episodes = -2: " in message


def test_a_problem_of_the_whole_has_no_field():
    with pytest.raises(ValidationError) as caught:
        Trial.model_validate(7)
    assert str(from_validation(caught.value, "trial")).startswith("trial: ")
    assert "trial:  =" not in str(from_validation(caught.value, "trial"))


def test_a_check_that_says_what_is_wrong_is_told_in_its_own_words():
    message = refused(Walk, {"task": "clif", "steps": 3})
    assert message == "plan a.toml: unknown task 'clif' (did you mean 'cliff'?). Known: cliff"


def test_a_check_that_does_not_is_told_with_its_field_and_value():
    message = refused(Walk, {"task": "clif", "steps": 4})
    assert "unknown task 'clif'" in message
    assert "; steps = 4: " in message
    assert message.endswith("an odd number is needed")


@pytest.mark.parametrize(
    ("given", "known", "meant"),
    [
        ("gamma", ["alpha", "discount"], " (did you mean 'discount'?)"),
        ("lr", ["epsilon", "learning_rate"], " (did you mean 'learning_rate'?)"),
        ("alpha", ["epsilon", "learning_rate"], " (did you mean 'learning_rate'?)"),
        ("max_episode_steps", ["discount", "episode_limit"], " (did you mean 'episode_limit'?)"),
        ("gama", ["gamma", "discount"], " (did you mean 'gamma'?)"),
        ("gamma", ["alpha", "epsilon"], ""),
        ("MiniGrid-Empty-5x5-v0", ["MountainCar-v0"], ""),
    ],
)
def test_another_word_for_a_name_is_known(given, known, meant):
    assert suggestion(given, known) == meant


def test_what_is_counted_is_in_the_singular_if_there_is_one():
    assert [counted(n, "trial") for n in (0, 1, 2, 2000)] == [
        "0 trials", "1 trial", "2 trials", "2,000 trials",
    ]  # fmt: skip
