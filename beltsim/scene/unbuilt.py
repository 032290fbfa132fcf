"""What a deck may ask for and this version does not run yet: refused by name, never ignored."""

from __future__ import annotations

import numpy as np

from beltsim.console import CommandError, ExitCode
from beltsim.inp import Block, Deck
from beltsim.scene.bodies import BOX, CYLINDER, Body, Population
from beltsim.scene.touching import Groups

NOT_BUILT = {
    "CHECKPOINT": "no *CHECKPOINT",
}


class SceneError(CommandError):
    """The solver cannot run this deck; one line a problem."""

    exit_code = ExitCode.INVALID_INPUT


def problem(block: Block, found: str, expected: str) -> str:
    """One line of an error text."""
    return f"{block.where}: found {found}, expected {expected}"


def refuse_unbuilt(deck: Deck) -> None:
    """Raise `SceneError` with everything in the deck that is valid but not built yet."""
    problems = [
        problem(block, f"*{keyword}, which is not built yet", expected)
        for keyword, expected in NOT_BUILT.items()
        for block in deck.blocks(keyword)
    ]
    if problems:
        raise SceneError("\n".join(problems))


def refuse_flying_cylinders(deck: Deck, population: Population, groups: Groups, meshes: list[Block]) -> None:
    """Raise `SceneError` for cylinders that fly and are bonded or may touch a mesh, which is not built yet."""
    flying = [body for body in population.bodies if body.shape == CYLINDER and body.fixed == "NO"]
    problems = []
    for body in flying:
        found = f"{body.name}, a CYLINDER with FIXED=NO, "
        for mesh in meshes:
            if groups.may_touch[groups.of(body.group), groups.of(mesh.get("CONTACT GROUP"))]:
                expected = "contact groups that keep them apart, or FIXED=POSITION or FIXED=YES"
                problems.append(
                    problem(
                        body.block,
                        f"{found}that may touch the mesh {mesh['NAME']}, which is not built yet",
                        expected,
                    )
                )
        own = population.id[[population.bodies[s] is body for s in population.species]]
        for block in deck.blocks("BOND"):
            if np.isin(block.rows["particles"], own).any():
                problems.append(
                    problem(block, f"a bond of {found}which is not built yet", "FIXED=POSITION or FIXED=YES")
                )
    if problems:
        raise SceneError("\n".join(problems[:10]))


def refuse_turning(deck: Deck, population: Population, slots_of) -> None:
    """Raise `SceneError` for a rotation about the local z of particles that fly: only what is held has such an axis."""
    problems = []
    for block in deck.blocks("MOTION"):
        if block.get("PART") is None and block["TYPE"] != "VELOCITY":
            for species in np.unique(population.species[slots_of(block, population)]):
                body = population.bodies[species]
                if body.fixed == "NO":
                    found = f"TYPE={block['TYPE']} of {body.name}, a {body.shape} with FIXED=NO"
                    problems.append(problem(block, found, "particles with FIXED=POSITION or FIXED=YES"))
    if problems:
        raise SceneError("\n".join(problems))


def refuse_sharp_boxes_on_meshes(population: Population, groups: Groups, meshes: list[Block]) -> None:
    """Raise `SceneError` for boxes with sharp edges that may touch a mesh: nothing of them would reach it."""
    problems = []
    for mesh in meshes:
        for body in population.bodies:
            touches = groups.may_touch[groups.of(body.group), groups.of(mesh.get("CONTACT GROUP"))]
            if body.shape == BOX and body.edge_radius <= 0.0 and touches:
                found = f"EDGE RADIUS=0 of rounded box {body.name}, which may touch the mesh {mesh['NAME']}"
                problems.append(problem(body.block, found, "an EDGE RADIUS above 0"))
    if problems:
        raise SceneError("\n".join(problems[:10]))


def refuse_sharp_boxes(touching: list[tuple[Body, Body]]) -> None:
    """Raise `SceneError` if boxes that may touch each other both have sharp edges: the law needs a rounding."""
    problems = []
    for first, second in touching:
        if first.edge_radius + second.edge_radius <= 0.0:
            found = f"EDGE RADIUS=0 of rounded boxes {first.name} and {second.name}, which may touch"
            problems.append(problem(first.block, found, "an EDGE RADIUS above 0 for one of them"))
    if problems:
        raise SceneError("\n".join(problems[:10]))
