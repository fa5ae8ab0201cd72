"""Every rule of the package with options under which it overrides some steps, not all."""

from typing import Any

BUMPERS = {"name": "stochastic-q-bumpers", "alpha": 0.2, "v_min": -10.0}

EXAMPLES: dict[str, dict[str, Any]] = {
    "none": {},
    "maximal": {},
    "local-q-thresholding": {"alpha": 0.4, "second": True},
    "stochastic-q-bumpers": {"alpha": 0.6, "v_min": -10.0},
    "hard-bumpers": {"alpha": 0.3, "v_min": -10.0},
    "random-override": {"probability": 0.4, "second": True},
    "trajectory-bumpers": {"path": (0, 1), "reach": 0},
    "closest-acceptable": {"alpha": 0.3},
    "closest-acceptable-unknown-goal": {"alpha": 0.3},
    "better-for-all-goals": {},
    "accept-or-reject": {"tolerance": 0.25},
    "shield": {"threshold": 0.5},
    "advice-on-a-budget": {"when": "mistakes", "budget": 9, "threshold": 0.5},
    "penalised-interventions": {"target": 0.2, "rate": 0.5},
    "risk-and-novelty": {"visits": 2, "risk": 0.75, "release": 0.25},
    "expert-mixing": {"share": 0.8, "decay": 0.5},
    "assist-as-needed": {"forgetting": 0.5, "gain": 1.0, "dead_band": 0.125, "v_min": -10.0},
    "undo": {"tolerance": 0.5},
    "correct": {"tolerance": 0.5},
    "learner-aware-bumpers": {"alpha": 0.3, "v_min": -10.0},
    "model-free-learner-aware-bumpers": {"alpha": 0.3, "v_min": -10.0},
    "budget": {"per_episode": 3, "of": BUMPERS},
    "fading": {"half_life": 1.5, "of": BUMPERS},
    "hysteresis": {"calm": 2, "of": BUMPERS},
}
