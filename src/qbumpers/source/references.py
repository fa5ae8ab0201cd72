"""What compiled code refers to by name."""

import dis
import types
from collections.abc import Iterator


def global_names(code: types.CodeType) -> list[tuple[str, list[str]]]:
    """Global names in code, each with the attributes that are taken of it at once."""
    found: dict[tuple[str, ...], None] = {}
    instructions = list(dis.get_instructions(code))
    for place, each in enumerate(instructions):
        if each.opname not in ("LOAD_GLOBAL", "LOAD_NAME"):
            continue
        chain = [str(each.argval)]
        for following in instructions[place + 1 :]:
            if following.opname not in ("LOAD_ATTR", "LOAD_METHOD"):
                break
            chain.append(str(following.argval))
        found[tuple(chain)] = None
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            found |= dict.fromkeys((root, *rest) for root, rest in global_names(constant))
    return [(root, list(rest)) for root, *rest in found]


def imports_of(code: types.CodeType) -> Iterator[tuple[str, list[str]]]:
    """Modules that code imports when it runs, and the names that it takes from them."""
    instructions = list(dis.get_instructions(code))
    for place, each in enumerate(instructions):
        if each.opname == "IMPORT_NAME":
            level = instructions[place - 2].argval
            names = [i.argval for i in instructions[place + 1 :] if i.opname == "IMPORT_FROM"]
            wanted = instructions[place - 1].argval or ()
            yield "." * int(level or 0) + each.argval, [n for n in names if n in wanted]
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from imports_of(constant)
