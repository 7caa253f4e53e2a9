"""Pages with generated blocks, and figures that stand outside them.

A table block begins with `<!-- publish: NAME -->` on a line of its own and ends with `<!-- /publish -->`. A figure in a
sentence stands in `<!-- p: NAME -->...<!-- /p -->`. GitHub and doxygen show neither comment. A line must not begin with a
comment of a figure: GitHub would take the line for HTML.
"""
import configparser
import fnmatch
import pathlib
import re
from typing import Callable, Dict, List, NamedTuple, Set, Tuple

BLOCK = re.compile(r"^(?P<begin>(?P<indent> *)<!-- publish: (?P<name>.+?) -->\n)(?P<body>(?:(?!<!-- publish: ).)*?)(?P<end> *<!-- /publish -->)",
                   re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?P<begin><!-- p: (?P<name>[^>]+?) -->)(?P<body>(?:(?!<!--).)*?)(?P<end><!-- /p -->)", re.DOTALL)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
NUMBER = r"\d[\d,]*(?:\.\d+)?"
UNITS = r"(?:[mµn]?s|(?:milli|micro)?seconds?|min|minutes?|hours?|[KMGT]i?B(?:/s)?|%|per cent|times|-?fold)"
BEGIN = r"(?<![\w.#/])(?<!\w-)"
# A number with a unit of gain, error, time or bytes, a factor, a decimal number, or a cell of a table that is a number.
FIGURE = re.compile(rf"{BEGIN}{NUMBER}[\s-]?{UNITS}(?!\w)|{BEGIN}{NUMBER}[x×](?![\w×])(?!\d)|factor of {NUMBER}"
                    rf"|{BEGIN}(?:\d+\.\d+(?:e-?\d+)?|\d+e-?\d+)(?![\w]|\.\d)|(?<=\|) *\**[-±]?{NUMBER}\**(?: \([^|]*\))? *(?=\|)")

Generate = Callable[[str, str], str]  # text of a block from its name and page


class Exempt(NamedTuple):
    """Figures that are no results: a pattern, and the pages where it may stand."""
    kind: str
    pages: str
    pattern: "re.Pattern[str]"


def read_exceptions(path: pathlib.Path) -> List[Exempt]:
    """The list of what may stand outside blocks. Each section has pages, a reason and patterns, one a line."""
    ini = configparser.ConfigParser(interpolation=None, delimiters=("=",), comment_prefixes=(";",))
    ini.read_string(path.read_text(encoding="utf-8"))
    found = []
    for kind in ini.sections():
        section = ini[kind]
        if not section.get("reason"):
            raise ValueError(f"{path.name}: [{kind}] has no reason")
        found += [Exempt(kind, section["pages"], re.compile(line, re.MULTILINE)) for line in section["patterns"].split("\n") if line]
    return found


def _body(match: "re.Match[str]", page: str, generate: Generate) -> str:
    """What is to stand in a block. Line breaks within a figure's sentence stay, and tables are indented like their markers."""
    new = generate(match["name"], page)
    if match.re is INLINE:
        return match["body"] if new.split() == match["body"].split() else new
    return "".join(f"{match['indent']}{line}".rstrip() + "\n" for line in new.split("\n"))


def rewrite(text: str, page: str, generate: Generate) -> str:
    """The page with all its blocks generated anew."""
    for pattern in (BLOCK, INLINE):
        text = pattern.sub(lambda match: match["begin"] + _body(match, page, generate) + match["end"], text)
    return text


def _blank(match: "re.Match[str]") -> str:
    """Blanks in place of a match, so that lines keep their numbers."""
    return re.sub(r"[^\n]", " ", match[0])


def prose(text: str) -> str:
    """The page without blocks, code, comments and targets of links."""
    text = BLOCK.sub(_blank, text)
    text = INLINE.sub(_blank, text)
    text = COMMENT.sub(_blank, text)
    text = re.sub(r"^```.*?^```", _blank, text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"(?<=\n\n)(?: {4}[^\n]*\n+)+", _blank, text)
    text = re.sub(r"(`+)(?!`)(?:(?!\n\n).)+?\1", _blank, text, flags=re.DOTALL)
    return re.sub(r"\]\([^)]*\)|<?https?://[^\s)>]+>?", _blank, text)


def outside(text: str, page: str, exceptions: List[Exempt], used: Set[Exempt]) -> List[Tuple[int, str]]:
    """Line and text of each figure outside a block that no exception covers. Adds to `used` those that cover one."""
    text = prose(text)
    spans = [(e, m.start(), m.end()) for e in exceptions if fnmatch.fnmatch(page, e.pages)
             for m in e.pattern.finditer(text)]
    found = []
    for match in FIGURE.finditer(text):
        covering = [e for e, begin, end in spans if begin <= match.start() and match.end() <= end]
        used.update(covering)
        if not covering:
            found.append((text.count("\n", 0, match.start()) + 1, match[0]))
    return found


def faults_of_markers(text: str) -> List[Tuple[int, str]]:
    """Comments that open no block or close none, and figures at the beginning of a line."""
    rest = INLINE.sub(_blank, BLOCK.sub(_blank, text))
    found = [(rest.count("\n", 0, m.start()) + 1, f"{m[0]} has no other end")
             for m in re.finditer(r"<!-- */?(?:publish|p)\b.*?-->", rest)]
    found += [(text.count("\n", 0, m.start()) + 1, f"a line begins with {m[0]}")
              for m in re.finditer(r"^[ \t]*<!-- p: .*?-->", text, re.MULTILINE)]
    return found


def differing(text: str, page: str, generate: Generate) -> Dict[int, str]:
    """By line, blocks that differ from what is generated now, or cannot be generated."""
    found = {}
    for pattern in (BLOCK, INLINE):
        for match in pattern.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            try:
                body = _body(match, page, generate)
            except (KeyError, IndexError, ValueError, OSError, TypeError, StopIteration) as error:
                found[line] = f"{match['name']}: {error if str(error) else type(error).__name__}"
                continue
            if body != match["body"]:
                found[line] = f"{match['name']} is not what --write generates"
    return found
