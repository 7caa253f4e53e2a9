"""Errors that end a program of this folder."""


class ComparisonError(Exception):
    """Something that is missing or cannot be read. The message names it, and says what to do where that is not plain."""
