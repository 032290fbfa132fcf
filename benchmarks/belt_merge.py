"""Triangles back to quads, side by side with gmsh and MeshLab: share of true quads found, wrong ones, seconds.

All get the same welded triangles. Ours numbers rows and columns and proves them; the others give loose quads.
gmsh and pymeshlab are optional (`pip install gmsh pymeshlab`); what is not installed is left out.

    python benchmarks/belt_merge.py [facets of the large belt, default 100000]
"""

import contextlib
import io
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from beltconverter.mesh import Mesh
from beltconverter.recover import Wishes, recover
from beltconverter.refusals import NotABelt

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import belts

DEGREE = np.pi / 180


def ours(points, facets):
    mesh = Mesh(points, facets, np.arange(len(facets)))
    (grid,) = recover(mesh, Wishes(), [])
    place = {tuple(point): number for number, point in enumerate(points.tolist())}
    node = np.array([place[tuple(point)] for point in grid.points.reshape(-1, 3).tolist()]).reshape(
        grid.points.shape[:2]
    )
    after = np.roll(node, -1, axis=0) if grid.is_ring else node[1:]
    node = node[: len(after)]
    return np.stack([node[:, :-1], after[:, :-1], after[:, 1:], node[:, 1:]], axis=-1).reshape(-1, 4)


def ours_timed(points, facets):
    """Only the recovery is timed: naming the quads by node is for the comparison."""
    mesh = Mesh(points, facets, np.arange(len(facets)))
    start = time.process_time()
    recover(mesh, Wishes(), [])
    return time.process_time() - start


def by_gmsh(algorithm):
    import gmsh

    def merge(points, facets):
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", algorithm)
        gmsh.option.setNumber(
            "Mesh.RecombineOptimizeTopology", 0
        )  # pair triangles, leave nodes where they are
        gmsh.option.setNumber("Mesh.RecombineNodeRepositioning", 0)
        gmsh.option.setNumber("Mesh.RecombineMinimumQuality", 0)
        surface = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addNodes(2, surface, np.arange(1, len(points) + 1), points.ravel())
        gmsh.model.mesh.addElementsByType(surface, 2, [], facets.ravel() + 1)
        start = time.process_time()
        gmsh.model.mesh.recombine()
        seconds = time.process_time() - start
        _, nodes = gmsh.model.mesh.getElementsByType(3)
        tags, where, _ = gmsh.model.mesh.getNodes()
        gmsh.finalize()
        # gmsh numbers nodes anew: they are told by their place.
        number = np.full(int(tags.max()) + 1, -1)
        number[tags.astype(np.int64)] = cKDTree(points).query(where.reshape(-1, 3))[1]
        return number[np.array(nodes, dtype=np.int64)].reshape(-1, 4), seconds

    return merge


def by_meshlab(level):
    import pymeshlab

    def merge(points, facets):
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(points, facets))
        start = time.process_time()
        meshes.meshing_tri_to_quad_dominant(level=level)
        seconds = time.process_time() - start
        polygons = [face for face in meshes.current_mesh().polygonal_face_list() if len(face) == 4]
        return np.array(polygons, dtype=np.int64).reshape(-1, 4), seconds

    return merge


def peers():
    found = {"beltconvert": lambda points, facets: (ours(points, facets), ours_timed(points, facets))}
    for name, make in {
        "gmsh Blossom": lambda: by_gmsh(1),
        "gmsh simple": lambda: by_gmsh(0),
        "MeshLab 0": lambda: by_meshlab(0),
        "MeshLab 1": lambda: by_meshlab(1),
    }.items():
        try:
            found[name] = make()
        except (ImportError, OSError) as error:
            print(f"{name}: left out ({error})")
    return found


def cases(large):
    skewed = {"straight": (60 * 0.05 - 0.8 * np.pi) / 2, "width": 0.35}
    rows = large // 60
    return {
        "troughed, random": (belts.racetrack(340, 33, straight=6.0, width=1.2, trough=0.6), "random"),
        "turnover, alternating": (belts.racetrack(200, 15, straight=4.0, turnover=True), "alternating"),
        "graded 10:1, random": (
            belts.strip(np.cumsum(np.geomspace(0.01, 0.1, 60)), 9, straight=2.0),
            "random",
        ),
        "open, skew 40, 1:1, random": (belts.flat(30, 9, skew=40 * DEGREE), "random"),
        "open, skew 40, 1:1, short": (belts.flat(30, 9, skew=40 * DEGREE), "other"),
        "open, skew 40, 10:1, random": (belts.flat(16, 9, pitch=0.5, skew=40 * DEGREE), "random"),
        "endless, skew 40, random": (belts.racetrack(60, 8, skew=40 * DEGREE, **skewed), "random"),
        "endless, chevron 40, random": (
            belts.racetrack(60, 15, skew=40 * DEGREE, chevron=True, **skewed),
            "random",
        ),
        f"{large} facets, random": (belts.racetrack(rows, 31, straight=rows / 50, width=1.5), "random"),
    }


def compared(made, diagonals, merge):
    """Share of true quads found, %, wrong quads and CPU seconds."""
    rng = np.random.default_rng(1)
    ordered = belts.facets_of(made, diagonals, rng)
    truth = {
        frozenset(one) | frozenset(two) for one, two in zip(ordered[::2].tolist(), ordered[1::2].tolist())
    }
    facets = belts.spoiled(ordered, rng, winding=False)
    points = np.ascontiguousarray(made.points.reshape(-1, 3))
    with contextlib.redirect_stdout(io.StringIO()):
        quads, seconds = merge(points, facets)
    found = {frozenset(quad) for quad in quads.tolist()}
    return 100 * len(found & truth) / len(truth), len(found - truth), seconds


def main() -> None:
    large = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    merges = peers()
    print("true quads found, % / wrong quads / CPU s")
    print(f"{'':30}" + "".join(f"{name:>20}" for name in merges))
    for name, (made, diagonals) in cases(large).items():
        line = f"{name:30}"
        for merge in merges.values():
            try:
                share, wrong, seconds = compared(made, diagonals, merge)
                line += f"{share:9.0f}/{wrong}/{seconds:.2f}".rjust(20)
            except NotABelt as refusal:
                line += refusal.cause.rjust(20)
        print(line)


if __name__ == "__main__":
    main()
