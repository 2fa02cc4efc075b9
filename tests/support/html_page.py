"""A page taken apart, for the tests of the report."""

from __future__ import annotations

from html.parser import HTMLParser


class Page(HTMLParser):
    """A page taken apart: links, tables (rows of cell texts), texts of the command blocks, all text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.tables: list[list[list[str]]] = []
        self.commands: list[str] = []
        self.tags: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self._in_commands = False
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attributes if name in ("src", "href", "xlink:href", "action")]
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
        elif tag == "pre":
            self._in_commands = ("class", "commands") in attributes
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open, f"</{tag}> closes nothing"
        assert self._open.pop() == tag, f"</{tag}> closes something else"

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attributes)
        self.handle_endtag(tag)

    def handle_data(self, data: str) -> None:
        self.text += data
        if self._open and self._open[-1] == "pre" and self._in_commands:
            self.commands += [line for line in data.splitlines() if line.strip()]
        if {"td", "th"} & set(self._open) and "title" not in self._open:
            self.tables[-1][-1][-1] += data

    def close(self) -> None:
        super().close()
        assert not self._open, f"never closed: {self._open}"


VOID = {"meta", "br", "link", "img", "input"}
