"""Experiments as data: their design, running them, and keeping what they find."""
