"""Land on the moon with an agent that acts at random, and save the pictures.

The expert that ships with the package assists it in three ways; each landing becomes an
animation in the current folder, framed in red when the assistant takes over. Needs the extra
`lunar` (in a checkout, `pip install -e ".[lunar]"`). Takes a few seconds.
"""

from typing import Any

import gymnasium
from PIL import Image, ImageOps

import qbumpers
from qbumpers.values import shipped_expert

EVERY = 5  # steps from one picture to the next, of the 50 per second
WIDTH, HEIGHT, FRAME = 300, 200, 4  # of a picture, in pixels

ASSISTANTS = {
    "unassisted": qbumpers.make_assistant("none"),
    "bumpers": qbumpers.make_assistant("stochastic-q-bumpers", alpha=0.8),
    "maximal": qbumpers.make_assistant("maximal"),
}


def picture(environment: gymnasium.Env, overridden: bool) -> Image.Image:
    """What is to be seen now, small."""
    seen: Any = environment.render()
    small = Image.fromarray(seen).resize((WIDTH, HEIGHT))
    return ImageOps.expand(small, FRAME, "red" if overridden else "black")


def fly(environment: gymnasium.Env) -> tuple[dict[str, Any], list[Image.Image]]:
    """An episode of random keys: the last `info`, and pictures."""
    _, info = environment.reset(seed=0)
    environment.action_space.seed(0)
    pictures, steps = [picture(environment, False)], 0
    while "assisted_episode" not in info:
        *_, info = environment.step(environment.action_space.sample())
        steps += 1
        if steps % EVERY == 0 or "assisted_episode" in info:
            pictures.append(picture(environment, info["assistance"]["overridden"]))
    return info, pictures


def main() -> None:
    for name, assistant in ASSISTANTS.items():
        lander = gymnasium.make("qbumpers/LunarLander-v0", render_mode="rgb_array")
        environment = qbumpers.SharedControl(lander, assistant, shipped_expert("lunar-lander"))
        info, pictures = fly(environment)
        path = f"lunar-lander-{name}.gif"
        pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=20 * EVERY)
        flown = info["assisted_episode"]
        ending = "landed" if info["success"] else "crashed" if info["crash"] else "out of time"
        print(
            f"{name}: {ending} after {flown['length']} steps, return {flown['return']:.1f}, "
            f"{flown['overrides']} overrides; see {path}"
        )


if __name__ == "__main__":
    main()
