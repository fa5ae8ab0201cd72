from hypothesis import given

from qbumpers.assistants.none import NoneOptions, none
from qbumpers.decisions import Decision
from tests import reference_simulation as plain
from tests.assistants.situations import assert_decides, noises, situations


@given(situations(), noises)
def test_agrees_with_the_plain_rule(situation, noise):
    assert_decides(none, situation, noise, NoneOptions(), plain.none(situation, noise))


@given(situations(), noises)
def test_never_overrides(situation, noise):
    assert none(situation, noise, NoneOptions()) == Decision(situation.proposed, 0.0)
