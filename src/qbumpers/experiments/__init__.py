"""Experiments as data: their design, running them, and storing what they find."""
