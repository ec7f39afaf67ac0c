"""Check the prose of comments, docstrings, messages and Markdown against the house style.

    python tools/prose_lint.py                     # every tracked or new file
    python tools/prose_lint.py --changed [BASE]    # only sentences on lines that changed since BASE
    python tools/prose_lint.py --count             # the number of findings of each kind
    python tools/prose_lint.py FILE ...            # these files

BASE is by default the commit where this branch left the published main branch, or the commit before this one. The exit
status is 1 if there is a finding. Generated files are not checked: the stub of the compiled module, and
benchmarks/README.md, which quotes the output of runs. Code in backticks, doctests, fenced blocks and strings that
contain Python is not prose. Each cell of an aligned table is a text of its own.

Findings:

- number: a number without a leading zero (write 0.07), outside of code, file suffixes and version numbers
- length: a sentence of more than 35 words (aim at 25)
- says-so: `says so` (name the exception, warning or attribute instead)
- repetition: the word `likewise` (repeat the noun instead)
- opening: a comment or docstring that begins with What, Whether, Of, How, Where or `Likewise` (begin with the noun or
  verb that a reader searches for; "True if" for a boolean)
- range: numbers with a unit joined by a dash (write "0.1 to 0.3 mm")
"""

from __future__ import annotations

import argparse
import ast
import re
import subprocess
import sys
import textwrap
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUFFIXES = {".py", ".cpp", ".hpp", ".md"}
EXCLUDED = re.compile(r"python/withe/_core\.pyi|benchmarks/README\.md|tests/data/|tools/licenses/")
MAX_WORDS = 35
MIN_MESSAGE_WORDS = 4  # a shorter string literal is a name or a key

QUOTED = r'"(?:\\.|[^"\\\n])*"'
PYTHON_TOKENS = re.compile(
    r"(?P<comment>\#[^\n]*)|(?P<string>\b[rbfu]{0,2}(?:\"{3}.*?\"{3}|'{3}.*?'{3}|" + QUOTED + r"|'(?:\\.|[^'\\\n])*'))"
    r"|(?P<quoted>(?:\"{3}.*?\"{3}|'{3}.*?'{3}|" + QUOTED + r"|'(?:\\.|[^'\\\n])*'))",
    re.DOTALL | re.IGNORECASE,
)
CPP_TOKENS = re.compile(
    r"(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<string>R\"(?P<fence>\w*)\(.*?\)(?P=fence)\"|" + QUOTED + ")"
    r"|'(?:\\.|[^'\\\n])+'|\b\d[\w'.]*",  # characters, and numbers with digit separators
    re.DOTALL,
)
STRING_MARKS = re.compile(r"^(?:R\"\w*\(|[rbfuRBFU]{0,2}(?:\"{3}|'{3}|\"|'))|(?:\)\w*\"|\"{3}|'{3}|\"|')$")
COMMENT_MARKS = re.compile(r"^\s*(?:#[:!]?|//[/!]?<?|/\*+<?|\*(?!/))|\*/\s*$")
DIRECTIVE = re.compile(r"^\s*(?:noqa|type:|ruff:|mypy:|NOLINT|clang-format|IWYU|!/|pragma)")

LIST_MARK = re.compile(r"\s*(?:[-*+]|\d+\.)\s+(?:\[.\]\s+)?")
CODE_SPAN = re.compile(r"``[^`]+``|`[^`]+`")
PLACEHOLDER = re.compile(r"\{(?:[^{}]|\{[^{}]*\})*\}")
GAP = re.compile(r"(?<=\S) {2,}(?=\S)")
ABBREVIATION = re.compile(
    r"(?:\b(?i:e\.g|i\.e|cf|vs|al|eqs?|secs?|figs?|chap|pp?|no|vol|approx|St|resp)|(?<!\d )(?<!/)\b[A-Z])\.$"
)
SENTENCE_END = re.compile(r"(?<=[.!?])[\"')\]*_]*\s+(?=[\"'(\[*_`-]*[A-Z0-9])|(?<=[.!?])[\"')\]*_]*\s+(?=`)")
WORD = re.compile(r"[A-Za-z0-9]")
SPOKEN = re.compile(r"[A-Za-z]{2}")

NUMBER = re.compile(r"(?<![\w.)\]}%:/\\*'\"^])\.\d+(?![\w.]*[/\\])(?!\w*[A-Za-z_]{2})(?!\.\d)")
SAYS_SO = re.compile(r"\b(?:says?|said|saying|tells?) so\b", re.IGNORECASE)
LIKEWISE = re.compile(r"\blikewise\b", re.IGNORECASE)
OPENING = re.compile(r"(?:What|Whether|Of|How|Where|Likewise)\b")
UNIT = r"(?:[mun]?m|cm|km|[mun]?s|min|h|%|[mk]?N|[kMG]?Pa|k?g|Hz|deg(?:rees)?|rad|edges|nodes|steps|times|px|pixels)"
RANGE = re.compile(r"(?<![\w.-])\d+(?:\.\d+)?\s?[-\u2013]\s?\d+(?:\.\d+)?\s" + UNIT + r"\b|(?<![\w.-])\d+\u2013\d+")

Lines = list[tuple[int, str]]


@dataclass(frozen=True)
class Passage:
    """Text of one comment, docstring, message or Markdown file, by line."""

    kind: str
    lines: Lines


@dataclass(frozen=True)
class Finding:
    """One place that the house style asks to rewrite."""

    path: str
    first: int
    last: int
    rule: str
    text: str

    def __str__(self) -> str:
        text = self.text if len(self.text) < 160 else self.text[:157] + "..."
        return f"{self.path}:{self.first}: {self.rule}: {text}"


def passages_of(path: str, text: str) -> Iterator[Passage]:
    """Split a source file into its comments, docstrings and messages; a Markdown file is one passage."""
    if path.endswith(".md"):
        yield Passage("markdown", list(enumerate(text.splitlines(), 1)))
        return
    is_python = path.endswith(".py")
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    line = 0
    comment: Lines = []
    comment_column = -1
    message: Lines = []
    message_end = -1
    for token in (PYTHON_TOKENS if is_python else CPP_TOKENS).finditer(text):
        kind = token.lastgroup if token.lastgroup != "fence" else "string"
        if kind is None:
            continue
        while line + 1 < len(starts) and starts[line + 1] <= token.start():
            line += 1
        before = text[starts[line] : token.start()]
        rows = token.group().split("\n")
        if kind == "comment":
            column = len(before)
            continues = comment and comment[-1][0] == line and column == comment_column and not before.strip()
            if comment and not continues:
                yield Passage("comment", comment)
                comment = []
            comment_column = column
            stripped = [COMMENT_MARKS.sub("", row) for row in rows]
            if not DIRECTIVE.match(stripped[0]):
                comment += [(line + 1 + offset, row) for offset, row in enumerate(stripped)]
            continue
        is_block = is_python and token.group().lstrip("rbfuRBFU")[:3] in ('"""', "'''")
        content = STRING_MARKS.sub("", token.group()).split("\n")
        lines = [(line + 1 + offset, row) for offset, row in enumerate(content)]
        if is_block and not before.strip():
            yield Passage("docstring", lines)
        elif message and not text[message_end : token.start()].strip():  # adjacent literals are one message
            last_number, last_row = message[-1]
            message = [*message[:-1], (last_number, last_row.removesuffix("\\n")), *lines]
            message_end = token.end()
        else:
            if message:
                yield Passage("message", message)
            message, message_end = lines, token.end()
    if comment:
        yield Passage("comment", comment)
    if message:
        yield Passage("message", message)


def is_code(text: str) -> bool:
    """Return True if the text of a string is Python."""
    try:
        ast.parse(textwrap.dedent(text))
    except (SyntaxError, ValueError):
        return False
    return True


def table_rows(rows: list[str]) -> set[int]:
    """Return the indices of the rows that belong to an aligned table: neighbours share the start of a column."""
    columns = [{gap.end() for gap in GAP.finditer(row.rstrip())} for row in rows]
    pairs = [index for index in range(len(rows) - 1) if columns[index] & columns[index + 1]]
    return {index + offset for index in pairs for offset in (0, 1)}


def paragraphs_of(passage: Passage) -> Iterator[Lines]:
    """Join the lines of each paragraph, list item, table cell or description; leave out code."""
    paragraph: Lines = []
    indent = -1
    in_fence = in_doctest = False
    if passage.kind == "message":
        words = sum(bool(SPOKEN.search(word)) for _, row in passage.lines for word in row.split())
        unescaped = "\n".join(row for _, row in passage.lines).replace("\\n", "\n")
        is_markup = "".join(row for _, row in passage.lines).lstrip().startswith("<")
        if words >= MIN_MESSAGE_WORDS and not is_markup and not is_code(unescaped):
            yield [(number, PLACEHOLDER.sub("{}", row).replace("\\n", " ")) for number, row in passage.lines]
        return
    tabular = table_rows([row for _, row in passage.lines]) if passage.kind != "markdown" else set()
    for index, (number, raw) in enumerate(passage.lines):
        row = raw.rstrip()
        text = row.strip()
        if text.startswith(("```", "~~~")):
            in_fence = not in_fence
        in_doctest = bool(text) and (text.startswith((">>>", "...")) or in_doctest) and passage.kind != "markdown"
        if not text or in_fence or in_doctest or text.startswith(("```", "~~~", "#!", ":")) or not text.strip("-=~ "):
            if paragraph:
                yield paragraph
            paragraph, indent = [], -1
            continue
        if text.startswith("|") or index in tabular:
            if paragraph:
                yield paragraph
            paragraph, indent = [], -1
            for cell in GAP.split(text) if index in tabular else text.strip("|").split(" | "):
                yield [(number, cell.strip())]
            continue
        marker = LIST_MARK.match(row)
        column = marker.end() if marker else len(row) - len(row.lstrip())
        # The first line stands beside the quotes or the opening mark, so its indent tells nothing.
        is_second = passage.kind != "markdown" and index == 1
        if paragraph and (marker or text.startswith("#") or (column != indent and not is_second)):
            yield paragraph
            paragraph = []
        indent = column
        paragraph.append((number, row[marker.end() :] if marker else text))
        if text.startswith("#"):
            yield paragraph
            paragraph, indent = [], -1
    if paragraph:
        yield paragraph


def sentences_of(paragraph: Lines) -> Iterator[tuple[int, int, str]]:
    """Split a paragraph into sentences, each with its first and last line."""
    text = ""
    starts: Lines = []
    for number, row in paragraph:
        text += " " if text and not text.endswith(" ") else ""
        starts.append((number, ""))
        text += row.strip() if len(paragraph) > 1 else row
        starts[-1] = (number, text)
    text = CODE_SPAN.sub(lambda span: "`" + "_" * (len(span.group()) - 2) + "`", text)

    def line_at(place: int) -> int:
        return next((number for number, upto in starts if place < len(upto)), starts[-1][0])

    begin = 0
    ends = [match for match in SENTENCE_END.finditer(text) if not ABBREVIATION.search(text[: match.start()])]
    for stop, resume in [*((match.start(), match.end()) for match in ends), (len(text), len(text))]:
        sentence = text[begin:stop].strip()
        if sentence:
            yield line_at(begin), line_at(max(begin, stop - 1)), sentence
        begin = resume


def findings_of(path: str, text: str) -> Iterator[Finding]:
    """Find what the house style forbids in one file."""
    for passage in passages_of(path, text):
        number, first_row = next(((n, row) for n, row in passage.lines if row.strip()), (0, ""))
        if passage.kind in ("comment", "docstring") and OPENING.match(first_row.strip()):
            yield Finding(path, number, number, "opening", first_row.strip())
        for paragraph in paragraphs_of(passage):
            for first, last, sentence in sentences_of(paragraph):
                if NUMBER.search(sentence):
                    yield Finding(path, first, last, "number", sentence)
                if sum(bool(WORD.search(word)) or "`" in word for word in sentence.split()) > MAX_WORDS:
                    yield Finding(path, first, last, "length", sentence)
                for rule, pattern in (("says-so", SAYS_SO), ("repetition", LIKEWISE), ("range", RANGE)):
                    if pattern.search(sentence):
                        yield Finding(path, first, last, rule, sentence)


def git(*arguments: str) -> str:
    """Return the output of a git command, empty if the command fails."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()


def default_base() -> str:
    """Return the commit to compare with, found as in tidy_changed.sh."""
    base = git("merge-base", "HEAD", "origin/main")
    return base if base and base != git("rev-parse", "HEAD") else git("rev-parse", "--quiet", "--verify", "HEAD~1")


def changed_lines(base: str) -> dict[str, set[int]]:
    """Return the lines of each file that were added or changed since a commit."""
    changed: dict[str, set[int]] = {}
    path = ""
    for row in git("diff", "--unified=0", "--no-color", "--diff-filter=d", base).splitlines():
        if row.startswith("+++ "):
            path = row.removeprefix("+++ b/")
        elif hunk := re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", row):
            start, count = int(hunk[1]), int(hunk[2] or 1)
            changed.setdefault(path, set()).update(range(start, start + count))
    return changed


def is_prose(path: str) -> bool:
    """Return True if the file is one that people read and write."""
    return Path(path).suffix in SUFFIXES and not EXCLUDED.match(path) and (ROOT / path).is_file()


def main() -> int:
    """Print the findings, and return 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("files", nargs="*", help="files to check (default: all)")
    parser.add_argument(
        "--changed", nargs="?", const="", metavar="BASE", help="check only lines changed since this commit"
    )
    parser.add_argument("--count", action="store_true", help="print only the number of findings of each kind")
    options = parser.parse_args()

    files = options.files or [*git("ls-files").splitlines(), *git("ls-files", "-o", "--exclude-standard").splitlines()]
    lines: dict[str, set[int]] | None = None
    if options.changed is not None:
        base = options.changed or default_base()
        if not base:
            print("No earlier commit to compare with: prose is not checked.")
            return 0
        lines = changed_lines(base)
        new = git("ls-files", "-o", "--exclude-standard").splitlines()
        files = [path for path in files if path in lines or path in new]
        print(f"prose: {sum(map(is_prose, files))} files changed since {base[:9]}")
        lines.update({path: set(range(1, 1_000_000)) for path in new})
    findings = [
        finding
        for path in sorted(set(files))
        if is_prose(path)
        for finding in findings_of(path, (ROOT / path).read_text())
        if lines is None or lines[path] & set(range(finding.first, finding.last + 1))
    ]
    if options.count:
        for rule, count in Counter(finding.rule for finding in findings).most_common():
            print(f"{count:6} {rule}")
    else:
        for finding in findings:
            print(finding)
        if findings:
            print(f"{len(findings)} findings; the rules stand in tools/prose_lint.py.")
    return bool(findings)


if __name__ == "__main__":
    sys.exit(main())
