"""The tests' own SAT files are sound B-reps: what is proved on them is proved on real solids."""

from __future__ import annotations

from collections import Counter

import pytest
import sat_solids as solids
from sat_solids import Solid, box, cylinder, revolve, roller, write_sat

from partconverter import sat
from partconverter.surfaces import off_surface
from partconverter.topology import read_model

FILLETED = [(0, -200), (95, -200, (95, -195)), (100, -195), (100, 195, (95, 195)), (95, 200), (0, 200)]
SOLIDS = {
    "cylinder": lambda: cylinder(133, 380, (1, 2, 3), (1, 2, 3)),
    "tube": lambda: cylinder(133, 380, bore=120, hole="cosine"),
    "quartered tube": lambda: cylinder(133, 380, bore=120, pieces=4),
    "seamed roller": lambda: roller(133, 380, 25, 430, seam=True),
    "fillets": lambda: revolve(FILLETED, pieces=3),
    "box": lambda: box((1, 2, 3)),
    "keyed": lambda: solids.extrude(solids.notched_circle(50, 14, 5), high=300),
    "half": lambda: solids.extrude(solids.half_disc(50), high=300),
    "plate": lambda: solids.extrude(solids.rectangle(400, 300), [solids.circle(40, ccw=False)], high=20),
    "rounded": lambda: solids.extrude(solids.rounded_rectangle(100, 50, 10), high=300),
    "radially drilled": lambda: solids.radially_drilled(200, 500, 10, 30),
    "drilled": lambda: solids.drilled(roller(400, 500, 80, 700), (0, 120, 250), (0, 0, 1), 15, 30),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_every_edge_is_run_once_each_way(name):
    solid: Solid = SOLIDS[name]()
    runs = Counter(use for shell in solid.shells for face in shell for loop in face.loops for use in loop)
    assert set(runs) == {(edge, way) for edge in range(len(solid.edges)) for way in (True, False)}
    assert set(runs.values()) == {1}


@pytest.mark.parametrize("name", SOLIDS)
def test_every_loop_closes(name):
    solid: Solid = SOLIDS[name]()
    for shell in solid.shells:
        for face in shell:
            for loop in face.loops:
                ends = [(solid.edges[e].start, solid.edges[e].end)[:: 1 if way else -1] for e, way in loop]
                assert all(end[1] == after[0] for end, after in zip(ends, ends[1:] + ends[:1]))


@pytest.mark.parametrize("name", SOLIDS)
def test_every_vertex_lies_on_its_faces(name):
    model = read_model(sat.read(write_sat([SOLIDS[name]()]).encode()))
    faces = [model.face(face) for face in model.solids[0].faces]
    points = [(face, point) for face in faces for edge, _ in face.edges for point in (edge.start, edge.end)]
    # Round-off of coordinates of some hundreds: 1e-16 x 1e3 x a few operations.
    assert max(off_surface(face.surface, point) for face, point in points) < 1e-11


@pytest.mark.parametrize("name", SOLIDS)
def test_euler_holds(name):
    solid: Solid = SOLIDS[name]()
    faces = [face for shell in solid.shells for face in shell]
    rings = sum(len(face.loops) - 1 for face in faces)
    # V - E + F - (L - F) = 2 (S - G): a tube and a plate with a through hole have genus 1.
    genus = 1 if name in ("tube", "quartered tube", "plate") else 0
    used = {v for e in solid.edges for v in (e.start, e.end)}
    assert len(used) - len(solid.edges) + len(faces) - rings == 2 * (1 - genus)
