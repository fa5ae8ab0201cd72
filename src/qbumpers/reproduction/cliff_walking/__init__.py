"""Cliff Walking: Sections 4.1 and 4.2 of the paper, with Figure 2."""
