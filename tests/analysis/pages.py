"""A report as a reader's browser takes it apart."""

from html.parser import HTMLParser

VOID = {"meta", "link", "img", "br", "hr", "input"}


class Page(HTMLParser):
    """Sections, tables, pictures and links of a page, and whether its tags are balanced."""

    def __init__(self, text):
        super().__init__()
        self.open, self.sections, self.nav = [], [], []
        self.pictures, self.links, self.references = {}, [], []
        self.tables, self.words = {}, []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.references += [
            values[key] for key in ("src", "href", "action", "data") if key in values
        ]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "h2":
            self.sections.append(values["id"])
        elif tag == "img":
            self.pictures[values["alt"]] = values["src"]
        elif tag == "a":
            (self.nav if "nav" in self.open else self.links).append(values["href"])
        elif tag == "tr":
            self.tables.setdefault(self.sections[-1], []).append([])
        elif tag in ("td", "th"):
            self.tables[self.sections[-1]][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)
        if {"td", "th"} & set(self.open):
            self.tables[self.sections[-1]][-1][-1] += data

    @property
    def text(self):
        """All words, with single spaces."""
        return " ".join("".join(self.words).split())


def number(value, digits=1):
    """A number as reports write it, a dash where there is none."""
    return "–" if value is None else f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def interval(row, measure, digits=1):
    mean, low, high = (number(row[f"{measure}_{part}"], digits) for part in ("mean", "low", "high"))
    return f"{mean} [{low}, {high}]"
