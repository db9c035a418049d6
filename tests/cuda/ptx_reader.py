# SPDX-License-Identifier: Apache-2.0
"""Reads PTX, as clang and nvcc write it, into functions and statements. ptx_to_cpp.py makes C++ of them."""
import re
from dataclasses import dataclass, field

SIZES = {"8": 1, "16": 2, "32": 4, "64": 8}


class Refused(Exception):
    """PTX that cannot be, or must not be, translated."""


@dataclass
class Array:
    """A parameter, a variable in local or shared memory or a table: bytes with a name."""
    name: str
    size: int
    align: int
    values: str = ""  # of a table: the text between its braces
    element: str = "b8"


@dataclass
class Function:
    name: str
    is_kernel: bool
    result: list[Array]
    parameters: list[Array]
    max_threads: int
    # Each is ("begin",), ("end",), ("label", name) or ("code", text).
    statements: list[tuple] = field(default_factory=list)
    defined: bool = False


@dataclass
class Module:
    functions: list[Function]
    tables: list[Array]
    shared: list[Array]


def split_commas(text):
    """Splits at commas outside of brackets."""
    parts, depth, part = [], 0, ""
    for character in text:
        depth += character in "{[("
        depth -= character in "}])"
        if character == "," and depth == 0:
            parts.append(part.strip())
            part = ""
        else:
            part += character
    if part.strip():
        parts.append(part.strip())
    return parts


def read_array(text):
    """`.param .align 8 .b8 name[24]`, `.local .align 4 .b8 name[8]`, `.param .b64 name`, `.param .b64 param0`."""
    match = re.search(r"\.([bsuf])(8|16|32|64)\s+(?:\.ptr\s+(?:\.\w+\s+)*(?:\d+\s+)?)?([\w$]+)\s*(?:\[(\d*)\])?", text)
    if not match:
        raise Refused(f"declaration {text!r}")
    kind, bits, name, count = match.groups()
    align = re.search(r"\.align\s+(\d+)", text)
    return Array(name, SIZES[bits] * int(count or 1), int(align.group(1)) if align else SIZES[bits],
                 element=kind + bits)


def matching(text, start, opening, closing):
    """Index after the bracket that closes the one at `start`."""
    depth = 0
    for i in range(start, len(text)):
        depth += text[i] == opening
        depth -= text[i] == closing
        if depth == 0:
            return i + 1
    raise Refused(f"no {closing} for {text[start:start + 40]!r}")


def read_statements(body):
    """Statements end with ';'. A brace that begins a statement opens a block, others enclose vectors."""
    statements, text, i = [], "", 0
    while i < len(body):
        character = body[i]
        if character == "{" and not text.strip():
            statements.append(("begin",))
            text = ""
        elif character == "}" and not text.strip():
            statements.append(("end",))
            text = ""
        elif character == ":" and re.fullmatch(r"\s*[\w$]+", text):
            statements.append(("label", text.strip()))
            text = ""
        elif character == ";":
            statements.append(("code", " ".join(text.split())))
            text = ""
        else:
            text += character
        i += 1
    if text.strip():
        raise Refused(f"unfinished statement {text.strip()!r}")
    return statements


def read_function(text, start):
    """The function whose `.entry` or `.func` is at `start`, and the index after it."""
    is_kernel = text.startswith(".entry", start)
    at = start + len(".entry" if is_kernel else ".func")
    result, parameters = [], []
    at += len(text[at:]) - len(text[at:].lstrip())
    if text[at] == "(":
        end = matching(text, at, "(", ")")
        result = [read_array(part) for part in split_commas(text[at + 1:end - 1])]
        at = end
    name = re.compile(r"\s*([\w$]+)\s*").match(text, at)
    at = name.end()
    if text[at] == "(":
        end = matching(text, at, "(", ")")
        parameters = [read_array(part) for part in split_commas(text[at + 1:end - 1])]
        at = end
    rest = re.compile(r"[^{;]*").match(text, at)
    threads = re.search(r"\.maxntid\s+([\d, ]+)", rest.group())
    max_threads = 1
    for count in threads.group(1).split(",") if threads else ["1024"]:
        max_threads *= int(count)
    function = Function(name.group(1), is_kernel, result, parameters, max_threads)
    if text[rest.end()] == ";":
        return function, rest.end() + 1
    end = matching(text, rest.end(), "{", "}")
    function.statements = read_statements(text[rest.end() + 1:end - 1])
    function.defined = True
    return function, end


def read_module(text):
    text = re.sub(r"//[^\n]*", "", text)
    module = Module([], [], [])
    item = re.compile(r"\.entry\b|\.func\b|\.(?:global|const|shared)\b[^;]*;")
    at = 0
    while match := item.search(text, at):
        if match.group() in (".entry", ".func"):
            function, at = read_function(text, match.start())
            module.functions.append(function)
            continue
        if match.group().startswith(".shared"):
            module.shared.append(read_array(match.group()[:-1]))
            at = match.end()
            continue
        declaration, _, values = match.group()[:-1].partition("=")
        table = read_array(declaration)
        table.values = values.strip().strip("{}")
        module.tables.append(table)
        at = match.end()
    return module
