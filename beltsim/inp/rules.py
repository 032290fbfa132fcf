"""Rules that hold for any file: within one block, and between the blocks that a file has."""

from __future__ import annotations

import numpy as np

from .bonds import bond_row_problems, repeated_bonds
from .deck import Block, Deck
from .errors import Gaps, Problems, listed
from .keywords import KEYWORDS
from .lookup import AllRows, Particles, by_name
from .schema import Keyword, Variant


def block_problems(block: Block, problems: Problems) -> None:
    """Note what is wrong within one block: parameters that belong together, counts of rows, values of both."""
    keyword = KEYWORDS[block.keyword]
    before = len(problems)
    variant = keyword.variant(block.get(keyword.decides)) if keyword.decides else None
    if variant is not None:
        _variant_parameters(block, keyword, variant, problems)
    _groups_of_parameters(block, keyword, problems)
    _row_count(block, (variant and variant.rows) or keyword.count, problems)
    special = _SPECIAL.get(block.keyword)
    if special and len(problems) == before:
        special(block, problems)


def deck_problems(deck: Deck, problems: Problems, gaps: Gaps) -> None:
    """Note what contradicts between blocks: ids and bonds given twice, sizes, stiffnesses of the contact model."""
    for keyword in ("PARTICLE", "PARTICLE SIZE", "INITIAL VELOCITY"):
        _repeated_ids(deck, keyword, problems)
    repeated_bonds(deck, problems)
    if not {"PARTICLE", "PARTICLE TYPE", "PARTICLE SIZE"} & gaps.content:
        _particle_sizes(deck, problems)
    if "CONTACT PROPERTY" not in gaps.content:
        _linear_stiffnesses(deck, problems)


# --- parameters and rows of one block ------------------------------------------------------------------------


def _variant_parameters(block: Block, keyword: Keyword, variant: Variant, problems: Problems) -> None:
    chosen = f"{keyword.decides}={block[keyword.decides]}"
    wanted = (*variant.required, *variant.allowed)
    for name in variant.required:
        if name not in block:
            problems.add(
                block.where, f"*{block.keyword}, {chosen} without {name}", listed(variant.required, "and")
            )
    decided = {name for _, other in keyword.variants for name in (*other.required, *other.allowed)}
    for name in sorted(decided & set(block.parameters) - set(wanted)):
        expected = listed(wanted, "and") if wanted else "no sizes"
        problems.add(block.where, f"{name} in *{block.keyword}, {chosen}", expected)


def _groups_of_parameters(block: Block, keyword: Keyword, problems: Problems) -> None:
    for group in keyword.together:
        given = [name for name in group if name in block]
        if given and len(given) < len(group):
            problems.add(
                block.where, f"*{block.keyword} with only {listed(given, 'and')}", listed(group, "and")
            )
    if not keyword.one_of:
        return
    given = [name for group in keyword.one_of for name in group if name in block]
    if tuple(given) not in keyword.one_of:
        found = (
            f"*{block.keyword} with {listed(given, 'and')}"
            if given
            else f"*{block.keyword} with none of them"
        )
        problems.add(
            block.where, found, f"either {listed([' and '.join(group) for group in keyword.one_of])}"
        )


def _row_count(block: Block, count: tuple[int, int | None], problems: Problems) -> None:
    rows = _rows_of(block)
    least, most = count
    if rows < least or (most is not None and rows > most):
        many = f"{least}" if least == most else f"at least {least}" if most is None else f"{least} to {most}"
        found = f"*{block.keyword} with {rows} data line{'' if rows == 1 else 's'}"
        problems.add(block.where, found, f"{many}: {_row_words(block)}" if most != 0 else "none")


def _rows_of(block: Block) -> int:
    if KEYWORDS[block.keyword].layout == "source":
        return sum(len(column) for column in block.rows.values())
    return len(block)


def _row_words(block: Block) -> str:
    columns = KEYWORDS[block.keyword].columns
    between = "; " if KEYWORDS[block.keyword].layout == "source" else ", "
    return between.join(", ".join(column.fields[: column.required or column.width]) for column in columns)


# --- values of one block ---------------------------------------------------------------------------------------


def _edge_radius(block: Block, problems: Problems) -> None:
    sizes = [block[name] for name in ("SIZE X", "SIZE Y", "SIZE Z", "DIAMETER", "LENGTH") if name in block]
    edge = block["EDGE RADIUS"]
    # a size written in a unit or computed from the radius may be an ulp below twice the radius
    if sizes and 2 * edge > min(sizes) * (1 + 1e-12):
        found = f"EDGE RADIUS={edge:.9g}"
        problems.add(block.where, found, f"at most {min(sizes) / 2:.9g} m, half the least size")


def _particle_type(block: Block, problems: Problems) -> None:
    _edge_radius(block, problems)
    if block["NAME"] in ("SAME", "OTHER"):
        problems.add(
            block.where, f"NAME={block['NAME']}", "another name: *BOND RULE gives SAME and OTHER a meaning"
        )


def _motion(block: Block, problems: Problems) -> None:
    kind = block["TYPE"]
    if kind in ("TENSION", "SUSPENSION", "SURFACE VELOCITY") and "PART" not in block:
        problems.add(block.where, f"TYPE={kind} of particles", "PART=name")
    if kind in ("FREE ROTATION", "TORQUE") and "PART" in block and "INERTIA" not in block:
        problems.add(
            block.where, f"TYPE={kind} of a part without INERTIA", "its moment of inertia about the axis"
        )
    if "AXIS" in block and not any(block["AXIS"]):
        problems.add(block.where, "an AXIS of length 0", "a direction")
    if not len(block):
        return
    vector = block.rows["vector"][0]
    if kind != "VELOCITY" and len(vector) != 3:
        problems.add(block.row_where(0), f"{len(vector)} fields", "3: x, y, z")
    if kind in ("TENSION", "SUSPENSION") and not vector[:3].any():
        problems.add(block.row_where(0), "a direction of length 0", "a direction x, y, z")


def _increasing_time(block: Block, problems: Problems) -> None:
    time = block.rows["time"]
    problems.add_rows(
        block,
        np.flatnonzero(np.diff(time) <= 0) + 1,
        lambda i: f"the time {time[i]:.9g} after {time[i - 1]:.9g}",
        "a later time in each row",
    )


def _box(block: Block, problems: Problems) -> None:
    box = block.rows["box"][0]
    for axis, low, high in zip("xyz", box[:3], box[3:]):
        if not low < high:
            problems.add(
                block.row_where(0), f"{axis}0={low:.9g} and {axis}1={high:.9g}", f"{axis}0 below {axis}1"
            )


def _source(block: Block, problems: Problems) -> None:
    _box(block, problems)
    if block.get("END") is not None and block["END"] <= block["START"]:
        problems.add(block.where, f"END={block['END']:.9g} and START={block['START']:.9g}", "END after START")
    fractions = block.rows["fractions"]
    names = [name for name, _ in fractions]
    if not fractions:
        if "PARTICLE TYPE" not in block:
            problems.add(
                block.where, "*SOURCE without PARTICLE TYPE", "one, or rows `particle type, mass fraction`"
            )
        return
    for i, (name, share) in enumerate(fractions):
        if not 0 < share <= 1:
            problems.add(
                block.row_where(2 + i), f"the mass fraction {share:.9g}", "a number above 0 and at most 1"
            )
        if name in names[:i]:
            problems.add(block.row_where(2 + i), f"{name!r} again", "each particle type once")
    total = sum(share for _, share in fractions)
    # fractions rounded to 7 digits, as people write them
    if abs(total - 1) > 1e-6:
        problems.add(block.row_where(2), f"mass fractions that sum to {total:.9g}", "a sum of 1")
    if "PARTICLE TYPE" in block and block["PARTICLE TYPE"] not in names:
        problems.add(
            block.where, f"PARTICLE TYPE={block['PARTICLE TYPE']}", f"one of its rows: {listed(names)}"
        )


def _measure(block: Block, problems: Problems) -> None:
    if len(block) and not block.rows["normal"][0].any():
        problems.add(block.row_where(0), "a normal of length 0", "a direction nx, ny, nz")


_SPECIAL = {
    "PARTICLE TYPE": _particle_type,
    "PART": _edge_radius,
    "MOTION": _motion,
    "AMPLITUDE": _increasing_time,
    "DOMAIN": _box,
    "SOURCE": _source,
    "MEASURE": _measure,
    "BOND": bond_row_problems,
}


# --- between blocks --------------------------------------------------------------------------------------------


def _repeated_ids(deck: Deck, keyword: str, problems: Problems) -> None:
    rows = AllRows(deck, keyword)
    ids = rows.column("id")
    order = np.argsort(ids, kind="stable")
    again = np.flatnonzero(np.diff(ids[order]) == 0) + 1
    problems.add_some(
        order[again],
        rows.where,
        lambda i: f"the id {ids[i]} again, first at {rows.where(int(np.flatnonzero(ids == ids[i])[0]))}",
        f"each id once in *{keyword}",
    )


def _particle_sizes(deck: Deck, problems: Problems) -> None:
    rows = AllRows(deck, "PARTICLE SIZE")
    if not len(rows):
        return
    particles, types = Particles(deck), by_name(deck, "PARTICLE TYPE")
    index = particles.index(rows.column("id"))
    known = [types.get(name) for name in particles.names]
    is_box = np.array([block is None or block.get("SHAPE") == "ROUNDED BOX" for block in known] + [True])
    edge = np.array([0.0 if block is None else block["EDGE RADIUS"] for block in known] + [0.0])
    kind = np.where(index < 0, len(known), particles.types[index] if len(particles.types) else 0)
    least = rows.column("size").min(axis=1, initial=np.inf)
    for i in np.flatnonzero(~is_box[kind]):
        found = f"a size of the particle type {particles.names[kind[i]]}, SHAPE={known[kind[i]]['SHAPE']}"
        problems.add(rows.where(int(i)), found, "the id of a ROUNDED BOX")
    thin = np.flatnonzero(2 * edge[kind] > least * (1 + 1e-12))
    problems.add_some(
        thin,
        rows.where,
        lambda i: f"the size {least[i]:.9g}",
        "sizes of at least twice the EDGE RADIUS of its type",
    )


def _linear_stiffnesses(deck: Deck, problems: Problems) -> None:
    if not any(block.get("TYPE") == "LINEAR" for block in deck.blocks("CONTACT MODEL")):
        return
    for block in deck.blocks("CONTACT PROPERTY"):
        if "NORMAL STIFFNESS" not in block:
            found = "*CONTACT PROPERTY without NORMAL STIFFNESS"
            problems.add(
                block.where,
                found,
                "NORMAL STIFFNESS and TANGENTIAL STIFFNESS for *CONTACT MODEL, TYPE=LINEAR",
            )
