"""Lunar Lander: its bodies, the stepper of simulators, and the environment for participants."""
