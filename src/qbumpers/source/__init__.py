"""What code of the user's own means: digests that comments, docstrings and lines do not change.

Functions and classes are followed to what they refer to: functions, classes and constants of the
user's own modules, what closures and defaults hold, and so on from there. Installed packages are
not followed but named with their versions, and modules of this package are named.

What runs is compared with what its file holds: a file that was edited after it was imported would
say something else than what runs.
"""

from qbumpers.source.meaning import Meaning, meaning_of
from qbumpers.source.origins import home_of, version_of

__all__ = ["Meaning", "home_of", "meaning_of", "version_of"]
