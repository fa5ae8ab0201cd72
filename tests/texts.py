"""Texts of the command line, as tests compare them."""

import re


def plain(text):
    """Text without the frames that help is drawn in."""
    lines = (re.sub(r"[─│╭╮╰╯━]", " ", line).split() for line in text.splitlines())
    return "\n".join(" ".join(words) for words in lines if words)


def words(text):
    return " ".join(text.split())
