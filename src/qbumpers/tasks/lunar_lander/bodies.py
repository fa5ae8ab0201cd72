"""The bodies of the lunar lander in Box2D, built as Gymnasium's class builds them."""

import ctypes
import functools
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from qbumpers.errors import RequestError

try:
    import Box2D
except ImportError as error:
    raise RequestError(
        "the lunar lander needs Box2D, which is not installed: pip install 'qbumpers[lunar]'"
    ) from error

SCALE = 30.0  # pixels per metre
WIDTH, HEIGHT = 600 / SCALE, 400 / SCALE  # metres
GRAVITY = -10.0
LEG_DOWN = 18 / SCALE

X, Y, ANGLE, VELOCITY_X, VELOCITY_Y, SPIN = 0, 1, 11, 13, 14, 15
"""Places of a body's numbers in what `motion_of` gives: float32, in metres, radians, seconds."""

_READ = (X, Y, ANGLE, VELOCITY_X, VELOCITY_Y, SPIN)

LEFT_LEG, RIGHT_LEG, CRASHED = 6, 7, 9
"""Places in the lander's state that contacts change."""

CORNERS = [(-14, 17), (-17, 0), (-17, -10), (17, -10), (17, 0), (14, 17)]
LEG_AWAY, LEG_HALF_WIDTH, LEG_HALF_HEIGHT, _LEG_TORQUE = 20 / SCALE, 2 / SCALE, 8 / SCALE, 40
_CHUNKS = 11
_HULL = 2  # distinct from the legs, 0 and 1

# Words of Box2D 2.3's b2Body, four bytes each: type, flags and island come first, then position,
# sine and cosine, and a sweep of local centre, two centres, two angles and a fraction.
_SKIPPED_BYTES = 12
_WORDS = 16


class Contacts(Box2D.b2ContactListener):
    """Writes into the state which legs touch the ground and whether the hull ever did.

    Args:
        state: float64, changed in place.
    """

    def __init__(self, state: np.ndarray) -> None:
        super().__init__()
        self._state = state

    def BeginContact(self, contact: Any) -> None:  # noqa: N802 (named by Box2D)
        """Something touches the ground."""
        part = _part(contact)
        self._state[CRASHED if part == _HULL else LEFT_LEG + part] = 1.0

    def EndContact(self, contact: Any) -> None:  # noqa: N802
        """Something leaves an edge of the ground, though it may still stand on another one."""
        part = _part(contact)
        if part != _HULL:
            self._state[LEFT_LEG + part] = 0.0


def _part(contact: Any) -> int:
    """Which part touches the ground, the only thing without a number of its own."""
    first = contact.fixtureA.body.userData
    return contact.fixtureB.body.userData if first is None else first


def ground_of(heights: np.ndarray) -> list[Any]:
    """The ground, to be built into every world; Box2D leaks a little with each edge made anew.

    Args:
        heights: [12], metres; those around the landing pad are levelled.

    Returns:
        A b2FixtureDef for each edge, the lowest one first.
    """
    levelled = heights.tolist()
    middle = _CHUNKS // 2
    levelled[middle - 2 : middle + 3] = [HEIGHT / 4] * 5
    smooth = [0.33 * (levelled[i - 1] + levelled[i] + levelled[i + 1]) for i in range(_CHUNKS)]
    across = [WIDTH / (_CHUNKS - 1) * i for i in range(_CHUNKS)]
    points = list(zip(across, smooth, strict=True))
    return [
        Box2D.b2FixtureDef(shape=Box2D.b2EdgeShape(vertices=[(0, 0), (WIDTH, 0)])),
        *(
            Box2D.b2FixtureDef(
                shape=Box2D.b2EdgeShape(vertices=list(edge)), density=0, friction=0.1
            )
            for edge in itertools.pairwise(points)
        ),
    ]


def build(ground: list[Any], force: tuple[float, float], contacts: Contacts) -> tuple[Any, Any]:
    """A world with the ground and a lander on which a force acts.

    A new world for every episode: Box2D keeps caches that change later episodes in an old one.

    Args:
        ground: from `ground_of`.
        force: newtons, during the first step.
        contacts: hears of contacts; must live as long as the world.

    Returns:
        The b2World and the b2Body of the hull, which lives as long as the world.
    """
    world = Box2D.b2World(gravity=(0, GRAVITY))
    world.contactListener = contacts
    earth = world.CreateStaticBody()
    for edge in ground:
        earth.CreateFixture(edge)
    hull = world.CreateDynamicBody(position=(WIDTH / 2, HEIGHT), angle=0.0, fixtures=_hull())
    hull.userData = _HULL
    hull.ApplyForceToCenter(force, True)
    for number, side in enumerate((-1, 1)):
        leg = world.CreateDynamicBody(
            position=(WIDTH / 2 - side * LEG_AWAY, HEIGHT), angle=side * 0.05, fixtures=_leg()
        )
        leg.userData = number
        world.CreateJoint(_hip(hull, leg, side))
    return world, hull


@functools.cache
def _hull() -> Any:
    corners = [(x / SCALE, y / SCALE) for x, y in CORNERS]
    return Box2D.b2FixtureDef(
        shape=Box2D.b2PolygonShape(vertices=corners),
        density=5.0,
        friction=0.1,
        categoryBits=0x0010,
        maskBits=0x001,  # collides with the ground only
        restitution=0.0,
    )


@functools.cache
def _leg() -> Any:
    return Box2D.b2FixtureDef(
        shape=Box2D.b2PolygonShape(box=(LEG_HALF_WIDTH, LEG_HALF_HEIGHT)),
        density=1.0,
        restitution=0.0,
        categoryBits=0x0020,
        maskBits=0x001,
    )


def _hip(hull: Any, leg: Any, side: int) -> Any:
    narrow, wide = 0.9 - 0.5, 0.9
    return Box2D.b2RevoluteJointDef(
        bodyA=hull,
        bodyB=leg,
        localAnchorA=(0, 0),
        localAnchorB=(side * LEG_AWAY, LEG_DOWN),
        enableMotor=True,
        enableLimit=True,
        maxMotorTorque=_LEG_TORQUE,
        motorSpeed=0.3 * side,
        lowerAngle=narrow if side == -1 else -wide,
        upperAngle=wide if side == -1 else -narrow,
    )


def motion_of(body: Any) -> Callable[[], np.ndarray]:
    """How to read the motion of a body in a fraction of the time that its attributes take.

    The numbers are read where the body lies in memory, after a check, once in a process, that they
    lie where they should; else they are copied from its attributes.

    Args:
        body: a b2Body, whose world the caller holds for as long as it reads.

    Returns:
        A function that gives float32 [16] as of now, at places X, Y, ANGLE, VELOCITY_X, VELOCITY_Y
        and SPIN, valid until the next step of the world.
    """
    if not _lies_as_expected():
        return functools.partial(_copied, body, np.zeros(_WORDS, np.float32))
    view = _view(body)
    return lambda: view


def _view(body: Any) -> np.ndarray:
    memory = (ctypes.c_float * _WORDS).from_address(int(body.this) + _SKIPPED_BYTES)
    view = np.ctypeslib.as_array(memory)
    view.flags.writeable = False
    return view


def _copied(body: Any, motion: np.ndarray) -> np.ndarray:
    motion[X], motion[Y] = body.position
    motion[VELOCITY_X], motion[VELOCITY_Y] = body.linearVelocity
    motion[ANGLE], motion[SPIN] = body.angle, body.angularVelocity
    return motion


@functools.cache
def _lies_as_expected() -> bool:
    """Whether a body of this Box2D has its numbers where Box2D 2.3 has them."""
    world = Box2D.b2World(gravity=(0, GRAVITY))
    shape = Box2D.b2PolygonShape(box=(1, 2, (0.5, 0.25), 0))  # its centre is not its position
    body = world.CreateDynamicBody(
        position=(1.5, 2.25),
        angle=0.375,
        linearVelocity=(3.5, 4.75),
        angularVelocity=5.125,
        fixtures=Box2D.b2FixtureDef(shape=shape, density=1.0),
    )
    try:
        created = _agrees(body)
        world.Step(0.02, 1, 1)  # afterwards the angles of the sweep differ
        return created and _agrees(body)
    except (TypeError, ValueError):
        return False


def _agrees(body: Any) -> bool:
    public = _copied(body, np.zeros(_WORDS, np.float32))
    return all(_view(body)[place] == public[place] for place in _READ)
