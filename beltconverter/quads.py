"""Quad meshes as meshers export them (Abaqus, gmsh, VTK, OBJ, PLY), through meshio and past its traps."""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
from pathlib import Path, PurePath

import numpy as np

from .mesh import Mesh, merge_equal
from .refusals import UnreadableMesh

SUFFIXES = (".inp", ".msh", ".vtk", ".vtu", ".obj", ".ply")
# Shells and membranes whose first four (three) nodes are the corners; meshio knows only some, in upper case, and
# leaves the process on any other.
QUAD_ELEMENTS = re.compile(r"^(S4|S4R|S4R5|S4RS|S4RSW|(CPS|CPE|CAX)4[A-Z]*|M3D4|M3D4R|SFM3D4|SFM3D4R|R3D4)$")
QUAD8_ELEMENTS = re.compile(r"^(S8R|S8R5|CPS8|CPS8R|M3D8|M3D8R|SFM3D8|SFM3D8R)$")
TRIANGLE_ELEMENTS = re.compile(r"^(S3|S3R|STRI3|CPS3|CPE3|M3D3|SFM3D3|R3D3)$")
FLAT_CELLS = {"quad": 4, "quad8": 4, "quad9": 4, "triangle": 3, "triangle6": 3}
VOLUMES = ("tetra", "hexahedron", "wedge", "pyramid")


def reads_quads(name: str) -> bool:
    """Whether a file of this name is a quad mesh, by its suffix."""
    return PurePath(name).suffix.lower() in SUFFIXES


def read_quads(data: bytes, name: str) -> Mesh:
    """Mesh of a quad file's bytes, each quad as two facets side by side; nodes that coincide exactly are one."""
    moved = (np.eye(3), np.zeros(3))
    if PurePath(name).suffix.lower() == ".inp":
        text = _decoded(data)
        moved = _instance(text, name)
        data = _plain_abaqus(text, name).encode()
    found = _by_meshio(data, name)
    points = np.asarray(found.points, dtype=np.float64)
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    if not np.isfinite(points).all():
        raise UnreadableMesh(name, "NaN or infinity in a node", "finite coordinates")
    nodes, index = merge_equal(points @ moved[0].T + moved[1])
    facets = index[_facets(found.cells, name)]
    return Mesh(nodes, facets, np.arange(len(facets)))


def _facets(blocks, name: str) -> np.ndarray:
    """Facets (F, 3) of all flat cells, those of a quad at 2k and 2k + 1."""
    solid = [block.type for block in blocks if block.type.startswith(VOLUMES)]
    if solid:
        raise UnreadableMesh(
            name, f"{solid[0]} elements", "a shell mesh, or the STL of the solid with --cell"
        )
    facets = []
    for block in blocks:
        if block.type not in FLAT_CELLS:
            continue
        corners = np.asarray(block.data, dtype=np.int64)[:, : FLAT_CELLS[block.type]]
        facets.append(corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3) if corners.shape[1] == 4 else corners)
    if not facets:
        raise UnreadableMesh(name, "no quads and no triangles", "a shell mesh of a belt")
    return np.concatenate(facets)


def _by_meshio(data: bytes, name: str):
    """meshio prints and leaves the process where it does not understand: both are caught here."""
    try:
        import meshio
    except ImportError:
        raise UnreadableMesh(name, "no package meshio", "it installed: pip install 'beltsim[mesh]'") from None
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"mesh{PurePath(name).suffix.lower()}"
        path.write_bytes(data)
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                return meshio.read(path)
        except (Exception, SystemExit) as error:
            reason = " ".join((said.getvalue() or str(error) or type(error).__name__).split())
            raise UnreadableMesh(
                name, f"'{reason[:200]}'", f"a {path.suffix} mesh that meshio reads"
            ) from None


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _keyword_lines(text: str) -> list[tuple[int, str, dict[str, str]]]:
    """Line number, keyword and parameters (upper case names) of every Abaqus keyword line."""
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("*") and not line.startswith("**"):
            keyword, *words = [word.strip() for word in line[1:].split(",")]
            pairs = (word.partition("=") for word in words)
            found.append(
                (number, keyword.upper(), {key.strip().upper(): value.strip() for key, _, value in pairs})
            )
    return found


def _plain_abaqus(text: str, name: str) -> str:
    """The text with nodes and shell elements only, all in the words that meshio knows."""
    lines = text.splitlines()
    keywords = _keyword_lines(text)
    kept = ["*HEADING", "mesh"]
    for (number, keyword, parameters), after in zip(keywords, [*keywords[1:], (len(lines) + 1, "", {})]):
        body = lines[number : after[0] - 1]
        if keyword == "NODE":
            kept += ["*NODE", *body]
        elif keyword == "ELEMENT":
            kept += [f"*ELEMENT, TYPE={_element(parameters.get('TYPE', ''), name, number)}", *body]
    return "\n".join(kept) + "\n"


def _element(kind: str, name: str, line: int) -> str:
    for pattern, plain in ((QUAD_ELEMENTS, "S4R"), (QUAD8_ELEMENTS, "S8R"), (TRIANGLE_ELEMENTS, "S3")):
        if pattern.match(kind.upper()):
            return plain
    raise UnreadableMesh(
        name, f"elements of TYPE={kind}", "shells such as S4R (S3, S4, S8R, M3D4R, R3D4)", line
    )


def _instance(text: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and translation of the only instance of an assembly, which meshio would silently ignore."""
    lines = text.splitlines()
    instances = [number for number, keyword, _ in _keyword_lines(text) if keyword == "INSTANCE"]
    if len(instances) > 1:
        expected = (
            "one instance: write each belt to its own file, or export a mesh without parts and assemblies"
        )
        raise UnreadableMesh(name, f"{len(instances)} instances", expected, instances[1])
    rows = []
    for line in lines[instances[0] :] if instances else ():
        if line.startswith("*"):
            break
        rows.append(_numbers(line, name, instances[0] + len(rows) + 1))
    shift = np.array(rows[0][:3]) if rows else np.zeros(3)
    if len(rows) < 2:
        return np.eye(3), shift
    *ends, angle = rows[1]
    turn = _turn(np.array(ends[3:6]) - np.array(ends[:3]), np.radians(angle))
    pivot = np.array(ends[:3])
    return turn, turn @ (shift - pivot) + pivot  # Abaqus translates first, then turns about the axis a-b


def _numbers(line: str, name: str, number: int) -> list[float]:
    try:
        values = [float(word) for word in line.split(",") if word.strip()]
    except ValueError:
        values = []
    if len(values) not in (3, 7):
        raise UnreadableMesh(name, f"'{line.strip()}'", "the translation or rotation of an instance", number)
    return values


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
