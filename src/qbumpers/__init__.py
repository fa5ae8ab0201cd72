"""Assistance that lets people learn: Stochastic Q Bumpers for shared control.

`import qbumpers` registers the Gymnasium environments; everything else loads when it is used. The
public names are listed in `__init__.pyi`.
"""

import gymnasium
import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

gymnasium.register(
    id="qbumpers/CliffWalking-v0",
    entry_point="qbumpers.tasks.cliff_walking:CliffWalking",
    max_episode_steps=100,
)
gymnasium.register(
    id="qbumpers/LunarLander-v0",
    entry_point="qbumpers.tasks.lunar_lander.environment:LunarLander",
    max_episode_steps=1000,
)
gymnasium.register(
    id="qbumpers/MountainCar-v0",
    entry_point="qbumpers.tasks.mountain_car:MountainCar",
    max_episode_steps=200,
    reward_threshold=-110.0,
)
