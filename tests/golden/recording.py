"""A recorded session on Cliff Walking, with which every host must agree.

`python -m tests.golden.recording` writes the file anew. That is needed only where the format or
the meaning of a decision changes on purpose; say why in the commit.
"""

import json
from pathlib import Path

import numpy as np

from qbumpers.assistants import make_assistant
from qbumpers.simulation import make_condition, record
from qbumpers.tasks import cliff_walking

PATH = Path(__file__).with_name("cliff_walking.json")
COLUMNS = (
    "state", "proposed", "coin", "tie", "executed", "probability", "projected_return", "reward",
)  # fmt: skip
"""Per step: where it began, what was proposed, the noise, and what came of it."""

ASSISTANT = {"name": "stochastic-q-bumpers", "options": {"alpha": 0.7, "second": True}}
EPISODES = 6


def write_recording() -> None:
    """Record one simulated learner's assisted episodes, from first exploration to near-greedy."""
    assistant = make_assistant(ASSISTANT["name"], **ASSISTANT["options"])
    steps = record(make_condition(cliff_walking(), assistant, episodes=EPISODES), seed=2019)
    episodes = [
        {column: getattr(steps, column)[steps.episode == episode].tolist() for column in COLUMNS}
        for episode in range(EPISODES)
    ]
    content = {"task": "cliff-walking", "assistant": ASSISTANT, "episodes": episodes}
    PATH.write_text(_one_line_a_column(content))


def read_recording() -> dict:
    """The stored session; the columns of each episode as arrays [N]."""
    content = json.loads(PATH.read_text())
    content["episodes"] = [
        {column: np.array(cells) for column, cells in episode.items()}
        for episode in content["episodes"]
    ]
    return content


def _one_line_a_column(content: dict) -> str:
    text = json.dumps({**content, "episodes": []}, indent=1)
    blocks = [
        ",\n".join(f"   {json.dumps(column)}: {json.dumps(cells)}" for column, cells in e.items())
        for e in content["episodes"]
    ]
    listed = ",\n".join(f"  {{\n{block}\n  }}" for block in blocks)
    return text.replace('"episodes": []', f'"episodes": [\n{listed}\n ]') + "\n"


if __name__ == "__main__":
    write_recording()
