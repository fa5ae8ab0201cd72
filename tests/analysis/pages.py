"""A report as a reader's browser takes it apart."""

import base64
from html.parser import HTMLParser

VOID = {"meta", "link", "img", "br", "hr", "input", "wbr"}


class Page(HTMLParser):
    """Sections, tables, pictures and links of a page, and whether its tags are balanced."""

    def __init__(self, text):
        super().__init__()
        self.open, self.sections, self.nav = [], [], []
        self.pictures, self.links, self.references, self.files = [], [], [], {}
        self.tables, self.words, self.subtitles = {}, [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.references += [
            values[key] for key in ("src", "href", "action", "data") if key in values
        ]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "h2":
            self.sections.append(values["id"])
        elif tag == "h3":
            self.subtitles.append("")
        elif tag == "img":
            self.pictures.append((values["alt"], values["src"]))
        elif tag == "a":
            self._link(values)
        elif tag == "table":
            self.tables.setdefault(self.sections[-1], []).append([])
        elif tag == "tr":
            self.tables[self.sections[-1]][-1].append([])
        elif tag in ("td", "th"):
            self.tables[self.sections[-1]][-1][-1].append("")

    def _link(self, values):
        if "download" in values:
            self.files[values["download"]] = content(values["href"])[1]
        else:
            (self.nav if "nav" in self.open else self.links).append(values["href"])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)
        if "h3" in self.open:
            self.subtitles[-1] += data
        if {"td", "th"} & set(self.open):
            self.tables[self.sections[-1]][-1][-1][-1] += data.replace("\N{NO-BREAK SPACE}", " ")

    def rows(self, section, table=0):
        """Rows of a section's table, without its head."""
        return self.tables[section][table][1:]

    @property
    def text(self):
        """All words, with single spaces."""
        return " ".join("".join(self.words).split())


def content(address):
    """Type and bytes of an address that holds them."""
    kind, _, data = address.partition(",")
    return kind, base64.b64decode(data, validate=True)


def number(value, digits=1):
    """A number as reports write it, a dash if there is none."""
    if value is None:
        return "–"
    return f"{round(value, digits):,.{max(0, digits)}f}".replace("-", "\N{MINUS SIGN}")


def interval(row, measure, digits=1):
    mean, low, high = (number(row[f"{measure}_{part}"], digits) for part in ("mean", "low", "high"))
    return f"{mean} no interval" if low == "–" else f"{mean} [{low}, {high}]"
