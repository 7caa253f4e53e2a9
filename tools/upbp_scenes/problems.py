"""What a conversion says: errors that end it, and warnings that it goes on after."""
import sys


class ConversionError(Exception):
    """A file that cannot be converted. The message names the file, and the line where there is one."""


class Warnings:
    """Prints each warning once, and keeps them for the converted file."""

    def __init__(self, stream=sys.stderr):
        self.lines = []
        self._stream = stream

    def add(self, text):
        if text in self.lines:
            return
        self.lines.append(text)
        print(f"warning: {text}", file=self._stream)
