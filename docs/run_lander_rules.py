"""Measure what was tried to do better than bumpers at Lunar Lander, with fresh seeds.

`python docs/run_lander_rules.py FOLDER` simulates learners with bumpers at their best setting and
with every rule of `lander_rules.py`, prints the verdict, then looks at the crashes that are left.
It takes about an hour on one core, keeps every learner in FOLDER, and goes on where it was stopped.
"""

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import lander_rules  # noqa: F401  (registers the rules)
import numpy as np
import polars as pl

from qbumpers import make_assistant, make_task, shipped_expert, simulate
from qbumpers.analysis.frontier import is_optimal
from qbumpers.analysis.statistics import difference, standard_error
from qbumpers.experts.correcting import correct_values
from qbumpers.experts.episodes import greedy, play, replay_then
from qbumpers.experts.loading import load_network
from qbumpers.random_streams import ENVIRONMENT, draw
from qbumpers.simulation import make_condition, record
from qbumpers.simulation.condition import streams
from qbumpers.tasks.dynamics import CRASH
from qbumpers.values import NetworkValues

DATA = Path(__file__).with_name("data")
SEED, EPISODES, FIRST = 4711, 2_000, 200
"""FIRST: episodes in which learners explore, and learn to land."""

BUMPERS = "bumpers, α = 1"


def first_of(episodes: int) -> int:
    """How many episodes count as the first ones."""
    return min(FIRST, episodes // 2)


class Tried(NamedTuple):
    """A rule to be measured.

    Attributes:
        rule: name and options of the assistant.
        learners: how many.
        corrected: whether it decides by corrected values.
    """

    rule: tuple[str, dict[str, Any]]
    learners: int = 3
    corrected: bool = False


TRIED = {
    BUMPERS: Tried(("stochastic-q-bumpers", {"alpha": 1.0}), 10),
    "more help at first": Tried(("scheduled-bumpers", {"begin": 0.5, "over": 150})),
    "less help always": Tried(("stochastic-q-bumpers", {"alpha": 1.0, "v_min": -22.0})),
    "no help after episode 200": Tried(("scheduled-bumpers", {"begin": 1.0, "until": FIRST}), 10),
    "α governed": Tried(("governed", {"share": 0.02})),
    "crashes foreseen": Tried(("watchful", {"alpha": 1.0}), corrected=True),
    "losses of late": Tried(("recent", {"alpha": 0.25})),
    "7 of 10 mistakes": Tried(("random-override", {"probability": 0.7})),
    "slips by a mirror": Tried(("mirrored", {"alpha": 0.2})),
}  # fmt: skip


class Course(NamedTuple):
    """What became of one learner, by episode.

    Attributes:
        assisted: float64 [E], returns.
        unassisted: float64 [E], returns.
        overrides: int64 [E].
        steps: int64 [E], of the assisted episodes.
    """

    assisted: np.ndarray
    unassisted: np.ndarray
    overrides: np.ndarray
    steps: np.ndarray


def corrected_values(folder: Path) -> NetworkValues:
    """The expert's values, corrected where learners go; made once."""
    path, task = folder / "corrected.npz", make_task("lunar-lander")
    if not path.exists():
        print("correcting the expert's values ...", flush=True)
        correct_values(task, shipped_expert(task.name)).values.save(path)
    return load_network(task, path)


def course(folder: Path, name: str, trial: int, episodes: int) -> Course:
    """Simulate a learner, or read what was kept of it."""
    tried, path = TRIED[name], folder / f"{name.replace(' ', '-')}-{trial}-of-{episodes}.npz"
    if not path.exists():
        values = corrected_values(folder) if tried.corrected else shipped_expert("lunar-lander")
        rule, options = tried.rule
        found = simulate(
            "lunar-lander", make_assistant(rule, **options), values=values, episodes=episodes,
            trials=range(trial, trial + 1), seed=SEED,
        ).outcomes  # fmt: skip
        kept = (found.assisted_return, found.unassisted_return, found.overrides,
                found.assisted_length)  # fmt: skip
        np.savez(path, **dict(zip(Course._fields, (each[0] for each in kept), strict=True)))
    with np.load(path) as arrays:
        return Course(**arrays)


def courses(folder: Path, learners: int, episodes: int) -> Iterable[tuple[str, int, Course]]:
    """All learners, the first ones of every rule first."""
    for trial in range(learners):
        for name, tried in TRIED.items():
            if trial < tried.learners:
                yield name, trial, course(folder, name, trial, episodes)


def row_of(name: str, trial: int, found: Course) -> dict[str, Any]:
    """What is archived of a learner: mean returns and shares of steps overridden."""
    first = first_of(len(found.steps))
    blocks = {"": slice(None), "_first": slice(0, first), "_rest": slice(first, None)}
    row: dict[str, Any] = {"rule": name, "learner": trial}
    for block, episodes in blocks.items():
        row[f"assisted{block}"] = found.assisted[episodes].mean()
        row[f"unassisted{block}"] = found.unassisted[episodes].mean()
        row[f"overridden{block}"] = found.overrides[episodes].sum() / found.steps[episodes].sum()
    return row


def part_rules(folder: Path, learners: int, episodes: int) -> pl.DataFrame:
    """Simulate all learners; returns a row per learner."""
    rows = []
    for name, trial, found in courses(folder, learners, episodes):
        rows.append(row_of(name, trial, found))
        last = rows[-1]
        print(f"{name:26} learner {trial}: assisted {last['assisted']:7.1f}, unassisted "
              f"{last['unassisted']:7.1f}", flush=True)  # fmt: skip
    return pl.DataFrame(rows)


def judged(rows: pl.DataFrame) -> dict[str, Any]:
    """What each rule brought, and how much more than bumpers; prints it."""
    found: dict[str, Any] = {}
    bumpers = rows.filter(pl.col("rule") == BUMPERS)
    print(f"\n{'':26}   assisted   unassisted   more than bumpers (95%)")
    for (name,), group in rows.group_by("rule", maintain_order=True):
        means = group.drop("rule", "learner").mean().row(0, named=True)
        each: dict[str, Any] = {"learners": len(group), **means}
        said = f"{name!s:26} {each['assisted']:10.1f} {each['unassisted']:12.1f}"
        for kind in ("assisted", "unassisted"):
            samples, rival = (g[kind].to_numpy() for g in (group, bumpers))
            each[f"{kind}_error"] = standard_error(samples)
            if name != BUMPERS:
                estimate = difference(samples, rival).estimate
                each[f"{kind}_more"] = estimate._asdict()
                said += f"   {estimate.low:+.1f} .. {estimate.high:+.1f}"
        print(said)
        found[str(name)] = each
    return found


def frontier_with(found: dict[str, Any]) -> list[str]:
    """Names of tried rules that no setting of bumpers beats in both returns; prints the verdict."""
    kept = pl.read_csv(DATA / "lunar-lander" / "trials.csv")
    kept = kept.filter(pl.col("assistant") == "stochastic-q-bumpers").group_by("alpha")
    settings = kept.agg(pl.col("assisted", "unassisted").mean()).drop("alpha").to_numpy()
    ours = [found[BUMPERS][kind] for kind in ("assisted", "unassisted")]
    beyond = [
        name for name, each in found.items() if name != BUMPERS
        and is_optimal(np.vstack([[each["assisted"], each["unassisted"]], ours, settings]))[0]
    ]  # fmt: skip
    ahead = [
        name for name, each in found.items() if name != BUMPERS
        and each["assisted_more"]["low"] > 0 and each["unassisted_more"]["low"] > 0
    ]  # fmt: skip
    print(f"\nAhead of {BUMPERS} in both returns: {', '.join(ahead) or 'none'}")
    print(f"Beyond the frontier of all settings of bumpers: {', '.join(beyond) or 'none'}")
    return beyond


BEFORE = (5, 10, 20, 30, 40, 80)
"""Steps before a crash at which the expert takes over."""


class Late(NamedTuple):
    """What bumpers at their best setting leave, after the first episodes.

    Attributes:
        episodes: that were looked at.
        crashes: among them.
        losses: float64 [N], of each step's proposal against a best action, by the expert's values.
        before: for each of `BEFORE`, by crash: the expert's value of the state, the corrected one,
            whether the expert lands from there, and what the episode then returns.
    """

    episodes: int
    crashes: int
    losses: np.ndarray
    before: dict[int, list[tuple[float, ...]]]


def late(folder: Path, trial: int, episodes: int) -> Late:
    """Simulate a learner and let the expert take over before its crashes."""
    task, values = make_task("lunar-lander"), shipped_expert("lunar-lander")
    corrected, stepper = corrected_values(folder), task.make_stepper()
    best = greedy(values, task.actions, np.random.default_rng(SEED))
    rule, options = TRIED[BUMPERS].rule
    assistant = make_assistant(rule, **options)
    condition = make_condition(task, assistant, values=values, episodes=episodes)
    steps = record(condition, trial=trial, seed=SEED)
    stream = streams(condition, range(trial, trial + 1), SEED)[0, 0, ENVIRONMENT].copy()
    chances = [draw(stream) for _ in range(episodes)]
    places, first = np.searchsorted(steps.episode, np.arange(episodes + 1)), first_of(episodes)
    before: dict[int, list[tuple[float, ...]]] = {each: [] for each in BEFORE}
    crashes = 0
    for episode in range(first, episodes):
        of = slice(places[episode], places[episode + 1])
        if not steps.events[of][-1] & CRASH:
            continue
        crashes += 1
        for each in (b for b in BEFORE if b < len(steps.executed[of])):
            state, done = steps.state[of][-each], steps.executed[of][:-each]
            saved = play(task, stepper, replay_then(done, best), chances[episode])
            before[each].append(
                (values(state).max(), corrected(state).max(), saved.success, saved.rewards.sum())
            )
    tail = slice(places[first], None)
    proposed = steps.values[tail][np.arange(len(steps.proposed[tail])), steps.proposed[tail]]
    losses = steps.values[tail].max(axis=1) - proposed
    return Late(episodes - first, crashes, losses, before)


def part_crashes(folder: Path, learners: int, episodes: int) -> dict[str, Any]:
    """What is left after the first episodes: crashes, and how little proposals differ."""
    seen = [late(folder, trial, episodes) for trial in range(learners)]
    crashes, many = sum(each.crashes for each in seen), sum(each.episodes for each in seen)
    losses = np.concatenate([each.losses for each in seen])
    agreed, median = float(np.mean(losses == 0)), float(np.median(losses[losses > 0]))
    print(f"\n{crashes} crashes in {many} episodes")
    print(f"{agreed:.0%} of the proposals are best actions, the others cost {median:.2f} (median)")
    rows = {each: [row for part in seen for row in part.before[each]] for each in BEFORE}
    means = {each: np.mean(found, axis=0).tolist() for each, found in rows.items() if found}
    print("steps before   V*   corrected   saved   return then")
    for each, (value, better, saved, brought) in means.items():
        print(f"{each:12} {value:5.1f} {better:10.1f} {saved:8.2f} {brought:10.1f}")
    return {"crashes": crashes, "episodes": many, "agreed": agreed, "median_loss": median,
            "before": means}  # fmt: skip


def main() -> None:
    """Measure, and keep the numbers of full runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="for learners that are done")
    parser.add_argument("--learners", type=int, help="of every rule; nothing is archived then")
    parser.add_argument("--episodes", type=int, default=EPISODES, help=f"{EPISODES} if not given")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    most = max(tried.learners for tried in TRIED.values())
    rows = part_rules(given.folder, given.learners or most, given.episodes)
    found = judged(rows)
    kept = {"rules": found, "beyond": frontier_with(found)}
    kept |= part_crashes(given.folder, min(given.learners or 2, 2), given.episodes)
    if given.learners is None and given.episodes == EPISODES:
        rows.write_csv(DATA / "learner-aware" / "lunar-lander.csv", float_precision=3)
        text = json.dumps(kept, indent=1)
        (DATA / "learner-aware" / "lunar-lander.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
