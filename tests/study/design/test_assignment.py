"""Assignment: balance, staleness, caps and yoking, for arrivals that Hypothesis makes up."""

from collections import Counter
from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers.study.design.assignment import Seat, Yoke, assign, yoked_dose
from qbumpers.study.design.conditions import Factor, crossed

HOUR = 3600.0


def factor(*levels, name="condition"):
    return Factor.model_validate({"name": name, "levels": list(levels)})


FREE = crossed([
    factor({"name": "alone", "assistant": "none"}, {"name": "helped", "assistant": "maximal"}),
    factor({"name": "hidden", "overrides": "hidden"}, {"name": "shown", "overrides": "shown"},
           name="overrides"),
])  # fmt: skip
YOKED = crossed([
    factor({"name": "helped", "assistant": "maximal"}, {"name": "yoked", "yoked_to": "helped"},
           {"name": "alone", "assistant": "none"}),
])  # fmt: skip
CAPPED = crossed([
    factor({"name": "alone", "assistant": "none", "cap": 3},
           {"name": "helped", "assistant": "maximal"}),
    factor({"name": "hidden", "overrides": "hidden"},
           {"name": "shown", "overrides": "shown", "cap": 4}, name="overrides"),
])  # fmt: skip

events = st.lists(
    st.tuples(
        st.sampled_from(["arrive", "complete", "leave", "end"]),
        st.floats(0, 1, exclude_max=True),
        st.floats(0, 900),
    ),
    max_size=60,
)


@dataclass
class People:
    """A little world of its own: who is there, kept without the code under test."""

    conditions: list
    orders: int = 1
    now: float = 0.0
    seats: list = field(default_factory=list)
    turned_away: int = 0

    def happen(self, what, draw, wait):
        self.now += wait
        ongoing = [n for n, seat in enumerate(self.seats) if seat.progress == "ongoing"]
        if what == "arrive":
            found = assign(self.conditions, self.orders, self.seats, self.now, HOUR, draw)
            if found is None:
                self.turned_away += 1
            else:
                self.seats.append(
                    Seat(f"p{len(self.seats)}", found.condition, found.order, "ongoing", self.now,
                         partner=found.partner)
                )  # fmt: skip
        elif ongoing and what != "leave":
            which = ongoing[int(draw * len(ongoing))]
            done = what == "complete"
            self.seats[which] = self.seats[which]._replace(
                progress="complete" if done else "ended", heard=self.now, trained=done
            )

    def counted(self):
        return [
            seat
            for seat in self.seats
            if seat.progress == "complete"
            or (seat.progress == "ongoing" and self.now - seat.heard <= HOUR)
        ]


@settings(max_examples=60, deadline=None)
@given(events)
def test_each_arrival_goes_to_a_least_filled_condition_and_order(happened):
    people = People(FREE, orders=2)
    for event in happened:
        people.now += event[2]
        before = Counter(seat.condition for seat in people.counted())
        orders = Counter((seat.condition, seat.order) for seat in people.counted())
        people.happen(event[0], event[1], 0.0)
        if event[0] == "arrive":
            found = people.seats[-1]
            assert before[found.condition] == min(before[c.name] for c in FREE)
            assert orders[found.condition, found.order] == min(
                orders[found.condition, order] for order in range(2)
            )


@given(st.lists(st.floats(0, 1, exclude_max=True), min_size=1, max_size=40))
def test_if_everybody_finishes_conditions_differ_by_one_at_most(draws):
    people = People(FREE, orders=3)
    for draw in draws:
        people.happen("arrive", draw, 1.0)
        people.happen("complete", 0.0, 1.0)
    filled = Counter(seat.condition for seat in people.seats)
    assert max(filled.values()) - min(filled[c.name] for c in FREE) <= 1
    for condition in FREE:
        orders = Counter(seat.order for seat in people.seats if seat.condition == condition.name)
        assert max(orders.values(), default=0) - min(orders[order] for order in range(3)) <= 1


def test_stale_ones_make_way_and_fresh_ones_do_not():
    gone = [Seat("a", "alone/hidden", 0, "ongoing", 0.0)]
    for now, free in [(HOUR, False), (HOUR + 1, True)]:
        found = {
            present.condition
            for draw in (0.0, 0.25, 0.5, 0.75, 0.99)
            if (present := assign(FREE, 1, gone, now, HOUR, draw))
        }
        assert ("alone/hidden" in found) is free


@settings(max_examples=60, deadline=None)
@given(events)
def test_caps_of_levels_are_never_passed(happened):
    people = People(CAPPED)
    for what, draw, _ in happened:
        people.happen(what, draw, 0.0)
        counted = people.counted()
        assert sum(seat.condition.startswith("alone") for seat in counted) <= 3
        assert sum(seat.condition.endswith("shown") for seat in counted) <= 4


def test_when_all_is_full_nobody_is_assigned():
    full = crossed([factor({"name": "a", "assistant": "none", "cap": 1},
                           {"name": "b", "assistant": "maximal", "cap": 1})])  # fmt: skip
    people = People(full)
    for _ in range(3):
        people.happen("arrive", 0.3, 0.0)
    assert {seat.condition for seat in people.seats} == {"a", "b"}
    assert people.turned_away == 1


@settings(max_examples=60, deadline=None)
@given(events)
def test_who_is_yoked_has_a_trained_partner_of_their_own(happened):
    people = People(YOKED)
    for what, draw, wait in happened:
        people.happen(what, draw, wait)
        yoked = [seat for seat in people.counted() if seat.condition == "yoked"]
        partners = [seat.partner for seat in yoked]
        assert len(set(partners)) == len(partners)
        for partner in partners:
            [seat] = [seat for seat in people.seats if seat.participant == partner]
            assert (seat.condition, seat.trained) == ("helped", True)
        assert all(not s.partner for s in people.seats if s.condition != "yoked")


def test_the_yoked_condition_waits_for_a_partner_then_catches_up():
    people = People(YOKED)
    for _ in range(4):
        people.happen("arrive", 0.0, 1.0)
    assert Counter(seat.condition for seat in people.seats) == {"helped": 2, "alone": 2}
    people.seats[0] = people.seats[0]._replace(trained=True)
    people.happen("arrive", 0.0, 1.0)
    assert people.seats[-1].condition == "yoked"
    assert people.seats[-1].partner == people.seats[0].participant
    people.happen("arrive", 0.0, 1.0)
    assert people.seats[-1].condition != "yoked"


yokes = st.lists(
    st.integers(1, 12).flatmap(lambda n: st.tuples(st.just(n), st.integers(0, n))),
    min_size=1,
    max_size=6,
).map(lambda episodes: Yoke(tuple(n for n, _ in episodes), tuple(m for _, m in episodes)))


@given(yokes, st.data())
def test_a_yoked_participant_is_owed_what_the_partner_had_and_no_more(yoke, data):
    delivered = 0
    for episode in range(len(yoke.lengths)):
        dose = yoked_dose(yoke, episode, delivered)
        assert dose.overrides == sum(yoke.overrides[: episode + 1]) - delivered
        assert 0 <= dose.probability <= 1
        assert (dose.probability > 0) == (dose.overrides > 0)
        delivered += data.draw(st.integers(0, dose.overrides))
    assert delivered <= sum(yoke.overrides)


def test_what_an_episode_missed_is_made_up_for_in_the_next():
    yoke = Yoke((5, 10), (2, 1))
    assert yoked_dose(yoke, 0, 0) == (2, 0.8)
    assert yoked_dose(yoke, 1, 2) == (1, 0.2)
    assert yoked_dose(yoke, 1, 0) == (3, 0.6)
    assert yoked_dose(yoke, 1, 3) == (0, 0.0)
    assert yoked_dose(yoke, 4, 0) == (3, 0.6)  # longer than the partner's
