"""Rules of a whole case, a deck that is to be run: its frame, its references, its contact properties."""

from __future__ import annotations

import numpy as np

from .bonds import bond_rule_problems
from .deck import Block, Deck
from .errors import Gaps, Problems, Where, nearest
from .keywords import KEYWORDS
from .lookup import AllRows, Particles, by_name, is_pattern, matching
from .rows import as_matrix
from .schema import Parameter
from .touching import contact_problems
from .values import id_ranges


def case_problems(deck: Deck, problems: Problems, gaps: Gaps, where: Where) -> None:
    """Note what keeps a deck from being run; `where` stands for the whole of it."""
    _frame(deck, problems, gaps, where)
    _names(deck, problems, gaps)
    if "CONTACT GROUP" not in gaps.content:
        _belts(deck, problems)
    _files(deck, problems)
    if not {"PART", "MOTION"} & gaps.content:
        _motions(deck, problems)
    if "PARTICLE" in gaps.content or "PARTICLE TYPE" in gaps.names:
        return
    particles = Particles(deck)
    _ids(deck, particles, problems)
    if not {"BOND RULE", "BOND", "BOND TYPE"} & gaps.content:
        bond_rule_problems(deck, particles, problems)
    if not _FOR_CONTACTS & gaps.content:
        contact_problems(deck, particles, problems)


_FOR_CONTACTS = {
    "CONTACT PROPERTY",
    "MATERIAL",
    "CONTACT GROUP",
    "CONTACT GROUP PAIR",
    "PARTICLE TYPE",
    "PART",
    "BOND",
    "BOND TYPE",
}


def _frame(deck: Deck, problems: Problems, gaps: Gaps, where: Where) -> None:
    blocks = deck.blocks()
    if blocks and blocks[0].keyword != "FORMAT" and "FORMAT" not in gaps.names:
        problems.add(blocks[0].where, f"*{blocks[0].keyword} first", "*FORMAT, NAME=BELTSIM, VERSION=1 first")
    if not blocks and not len(problems):
        problems.add(where, "no keywords", "*FORMAT, NAME=BELTSIM, VERSION=1 and a case")
    elif not deck.blocks("STEP") and "STEP" not in gaps.names:
        problems.add(where, "no *STEP", "at least one *STEP, DURATION=...")


# --- references ------------------------------------------------------------------------------------------------


def _names(deck: Deck, problems: Problems, gaps: Gaps) -> None:
    """Every name that a parameter or a source's row refers to is defined."""
    known = {
        refers: list(by_name(deck, refers))
        for refers in {parameter.refers for keyword in KEYWORDS.values() for parameter in keyword.parameters}
        if refers and refers not in gaps.names
    }
    for block in deck.blocks():
        for parameter in KEYWORDS[block.keyword].parameters:
            if parameter.refers in known and parameter.name in block:
                _name(block, parameter, known[parameter.refers], problems)
    if "PARTICLE TYPE" in known:
        _fractions(deck, known["PARTICLE TYPE"], problems)


def _name(block: Block, parameter: Parameter, known: list[str], problems: Problems) -> None:
    value = block[parameter.name]
    if value in parameter.words or value in known:
        return
    if parameter.wildcards and is_pattern(value):
        if not matching(known, value):
            expected = f"a pattern that matches a *{parameter.refers}"
            problems.add(block.where, f"{parameter.name}={value}", expected)
        return
    expected = f"the name of a *{parameter.refers}{nearest(value, known)}"
    problems.add(block.where, f"{parameter.name}={value}", expected)


def _fractions(deck: Deck, known: list[str], problems: Problems) -> None:
    for block in deck.blocks("SOURCE"):
        for i, (name, _) in enumerate(block.rows["fractions"]):
            if name not in known:
                expected = f"the name of a *PARTICLE TYPE{nearest(name, known)}"
                problems.add(block.row_where(2 + i), repr(name), expected)


def _belts(deck: Deck, problems: Problems) -> None:
    belts = [group["BELT"] for group in deck.blocks("CONTACT GROUP") if "BELT" in group]
    for block in [*deck.blocks("FILL"), *(one for one in deck.blocks("MEASURE") if "BELT" in one)]:
        if block.get("BELT") not in belts:
            expected = f"the BELT of a *CONTACT GROUP{nearest(str(block.get('BELT')), belts)}"
            problems.add(block.where, f"BELT={block.get('BELT')}", expected)


def _files(deck: Deck, problems: Problems) -> None:
    for block in deck.blocks("PART"):
        if "INPUT" in block and not block.path().is_file():
            problems.add(block.where, f"INPUT={block['INPUT']}, which is no file", "the file of a mesh")


def _ids(deck: Deck, particles: Particles, problems: Problems) -> None:
    columns = {"PARTICLE SIZE": "id", "INITIAL VELOCITY": "id", "FORCE": "id", "BOND": "particles"}
    for keyword, column in columns.items():
        rows = AllRows(deck, keyword)
        ids = as_matrix(rows.column(column))
        missing = particles.index(ids) < 0
        problems.add_some(
            np.flatnonzero(missing.any(axis=1)),
            rows.where,
            lambda i, ids=ids, missing=missing: f"the id {ids[i][missing[i]][0]}",
            "the id of a *PARTICLE",
        )
    for block in deck.blocks("MOTION"):
        if "PARTICLES" in block and (missing := _missing_of(block["PARTICLES"], particles)) is not None:
            problems.add(block.where, f"the id {missing} in PARTICLES", "the ids of *PARTICLE rows")


def _missing_of(ids: str, particles: Particles) -> int | None:
    """The first id of a PARTICLES text that no particle has."""
    for first, last in id_ranges(ids):
        # a range longer than the number of particles has a gap within that many ids
        wanted = np.arange(first, min(last, first + len(particles.ids)) + 1)
        missing = wanted[particles.index(wanted) < 0]
        if len(missing):
            return int(missing[0])
    return None


def _motions(deck: Deck, problems: Problems) -> None:
    """What a motion asks of the shape of its parts."""
    parts = by_name(deck, "PART")
    for block in deck.blocks("MOTION"):
        if "PART" not in block or block.get("TYPE") is None:
            continue
        for name in matching(parts, block["PART"]):
            _motion_of(block, parts[name], problems)


def _motion_of(block: Block, part: Block, problems: Problems) -> None:
    kind, shape, title = block["TYPE"], part.get("SHAPE"), f"*PART, NAME={part['NAME']}"
    turning = kind in ("ROTATION", "FREE ROTATION", "TORQUE")
    if turning and shape == "MESH" and "AXIS" not in block:
        problems.add(block.where, f"TYPE={kind} of the mesh {part['NAME']} without AXIS", 'AXIS="x, y, z"')
    if turning and shape == "CYLINDER" and "AXIS" in block:
        problems.add(
            block.where, f"AXIS with {title}, SHAPE=CYLINDER", "no AXIS: a cylinder turns about local z"
        )
    if turning and shape == "PLANE":
        problems.add(block.where, f"TYPE={kind} of {title}, SHAPE=PLANE", "a CYLINDER or MESH")
    if kind == "SURFACE VELOCITY" and shape == "CYLINDER":
        problems.add(
            block.where, f"TYPE={kind} of {title}, SHAPE=CYLINDER", "a MESH or PLANE; cylinders have ROTATION"
        )
