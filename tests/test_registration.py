"""What is said of functions that cannot be compiled."""

from qbumpers.compilation import shortened


def test_a_message_of_numba_is_one_line_without_colours():
    coloured = (
        "Failed in nopython mode\n\x1b[33m\x1b[1mUnknown attribute 'median'\x1b[0m\n\x1b[1m\n"
        '\x1b[37m\x1b[1m  File "rule.py", line 13:\x1b[0m\na fifth line'
    )
    assert shortened(TypeError(coloured)) == (
        "Failed in nopython mode; Unknown attribute 'median'; File \"rule.py\", line 13:"
    )
