"""Lunar Lander: Section 4.3 of the paper, with Figure 4."""
