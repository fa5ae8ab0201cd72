"""Records for tests, made without a server."""

import json

from qbumpers.play.game import Game
from qbumpers.play.tables import EPISODES, SESSIONS, STEPS, open_records, step_row
from qbumpers.play.writing import Writer


def record(setup, path, episodes, session="one", seed=11):
    """Play episodes, each a choice with a list of actions, and write them down; the game."""
    writer = Writer(open_records(path))
    game = Game(setup, seed)
    writer.add([(SESSIONS, {"session": session, "began": 0.0, "seed": str(seed),
                            "setup": setup.described(), "version": "0"})])  # fmt: skip
    for episode, (choice, actions) in enumerate(episodes):
        game.begin(choice)
        about = {"assistant": choice.name, "options": json.dumps(choice.options)}
        row = {"session": session, "episode": episode, "began": 0.0, **about}
        writer.add([(EPISODES, {**row, "assisted": choice.assisted})])
        for action in actions:
            if not game.playing:
                break
            number = game.number
            row = step_row(session, number, episode, game.propose(action))
            times = {"shown": 1000.0 * number, "pressed": 1000.0 * number + 400}
            times |= {"received": number + 0.5, "applied": 0.5 * number}
            writer.add([(STEPS, {**row, **times, "device": "keyboard"})])
    writer.close()
    return game
