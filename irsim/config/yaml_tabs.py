"""Tabs in YAML: those that separate are read (YAML 1.2.2, 6.2 "Separation Spaces"), which PyYAML alone refuses."""

from __future__ import annotations

from yaml.error import Mark
from yaml.reader import Reader
from yaml.scanner import Scanner

_BLANK = " \t"
_ENDS = "\0\r\n\x85\u2028\u2029"
"""What ends a line; a text ends in a zero."""


class TabScanner(Reader, Scanner):
    """A scanner to which a tab between two words of a line, or behind the last, is as a space. Before the first, where
    it would indent (6.1), it is none, but within [ ] and { }, where nothing hangs on that, and in lines without a word.
    """

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        self._has_tabs = "\t" in text
        self.tab: Mark | None = None
        """The last tab that stands where a list or a mapping could begin but for it, as in `-<TAB>a: 1`: their columns
        would be those of its keys or entries."""

    def scan_to_next_token(self) -> None:
        super().scan_to_next_token()
        while self.peek() == "\t" and self._separates():
            if not self.flow_level and self.allow_simple_key:
                self.tab = self.get_mark()
                self.allow_simple_key = False
            self.forward(self._blanks())
            super().scan_to_next_token()

    def scan_plain_spaces(self, indent: int, start_mark: Mark) -> list[str] | None:
        """What stands between words of a text without quotes; nothing where it ends."""
        if self._has_tabs and (between := self._between()):
            return [between]
        found: list[str] | None = super().scan_plain_spaces(indent, start_mark)
        if self._has_tabs and self.flow_level and found:  # in its next line
            self.forward(self._blanks())
        return found

    def _between(self) -> str:
        """Blanks with tabs among them before another word of the line; before its end they are passed over."""
        count = self._blanks()
        follows = self.peek(count)
        if follows == "#" or "\t" not in (between := self.prefix(count)):
            return ""
        self.forward(count)
        return "" if follows in _ENDS else between

    def _blanks(self) -> int:
        """How many blanks stand here."""
        count = 0
        while self.peek(count) in _BLANK:
            count += 1
        return count

    def _separates(self) -> bool:
        """Is the tab here none that indents?"""
        if self.flow_level or self.peek(self._blanks()) in f"#{_ENDS}":
            return True
        before = self.pointer - 1
        while before >= 0 and self.buffer[before] in _BLANK:
            before -= 1
        return before >= 0 and self.buffer[before] not in _ENDS
