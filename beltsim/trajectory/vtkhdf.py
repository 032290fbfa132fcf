"""Lays a VTKHDF view (PolyData, transient) over the H5MD data, for ParaView; no payload is stored twice.

VTK wants the frames one after the other, (T*N, ...), where H5MD has (T, N, ...): virtual datasets give that
view, declared once for all frames that the file can hold. Declaring them anew for each frame left one file in
twenty unreadable after a kill. Arrays of equal rank are hard links; what never changes is read from offset 0
each frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from beltsim.trajectory.layout import PARTICLES, PROPERTIES, Contents, empty_value

if TYPE_CHECKING:
    import h5py

TOPOLOGIES = ("Vertices", "Lines", "Strips", "Polygons")


def create(file: h5py.File, contents: Contents, capacity: int) -> h5py.Group:
    """Write /VTKHDF for `capacity` frames, none of them counted yet; returns its Steps group."""
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array([2, 2], "i8")
    # VTK reads the type only from a fixed-length ASCII string.
    root.attrs.create("Type", np.bytes_("PolyData"))
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(0)
    steps["Values"] = file["particles/all/position/time"]
    _create_offsets(steps, contents.slots, capacity)
    _create_counts(file, root, contents, capacity)
    _create_topology(root, contents)
    _create_point_data(file, root, contents, capacity)
    _create_cell_data(file, root, contents, capacity)
    return steps


def append(file: h5py.File, contents: Contents, t: int, active: int) -> None:
    """What one frame adds: in a dynamic scene, where the cell data of its lines begin."""
    if contents.dynamic and contents.n_bonds:
        for offsets in file["VTKHDF/Steps/CellDataOffsets"].values():
            offsets[t] = t * (contents.slots + contents.n_bonds) + contents.slots - active


def _create_offsets(steps: h5py.Group, slots: int, capacity: int) -> None:
    frames = np.arange(capacity, dtype="i8")
    steps["PartOffsets"] = frames
    steps["PointOffsets"] = frames * slots
    steps["NumberOfParts"] = np.ones(capacity, "i8")
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((capacity, len(TOPOLOGIES)), "i8")


def _create_counts(file: h5py.File, root: h5py.Group, contents: Contents, capacity: int) -> None:
    """One count a frame: each active particle is a point, a vertex and a connectivity id, one array for all.

    It has to grow: VTK takes all counts for pieces of one frame while there is but one frame.
    """
    points = root["NumberOfPoints"] = file["beltsim/active"]
    bonds = contents.n_bonds
    constants = {"Lines": (bonds, 2 * bonds), "Strips": (0, 0), "Polygons": (0, 0)}
    for name in TOPOLOGIES:
        group = root.create_group(name)
        if name == "Vertices":
            group["NumberOfCells"] = group["NumberOfConnectivityIds"] = points
        else:
            cells, ids = constants[name]
            group["NumberOfCells"] = np.full(capacity, cells, "i8")
            group["NumberOfConnectivityIds"] = np.full(capacity, ids, "i8")


def _create_topology(root: h5py.Group, contents: Contents) -> None:
    """Cells that never change: a frame with n particles reads the first n vertices."""
    lines = np.zeros(0, "i8") if contents.bonds is None else np.asarray(contents.bonds, "i8").ravel()
    for name, connectivity, size in (
        ("Vertices", np.arange(contents.slots, dtype="i8"), 1),
        ("Lines", lines, 2),
        ("Strips", np.zeros(0, "i8"), 1),
        ("Polygons", np.zeros(0, "i8"), 1),
    ):
        root[name]["Connectivity"] = connectivity
        root[name]["Offsets"] = np.arange(0, len(connectivity) + 1, size, dtype="i8")


def _create_point_data(file: h5py.File, root: h5py.Group, contents: Contents, capacity: int) -> None:
    particles = file["particles/all"]
    data, offsets = root.create_group("PointData"), root["Steps"].create_group("PointDataOffsets")
    _flattened(root, "Points", particles["position/value"], capacity)
    for name in ("id", *PROPERTIES, *PARTICLES):
        if name == "position" or name not in particles:
            continue
        if f"{name}/value" in particles:
            _flattened(data, name, particles[f"{name}/value"], capacity)
            offsets[name] = np.arange(capacity, dtype="i8") * contents.slots
        else:
            data[name] = particles[name]
            offsets[name] = np.zeros(capacity, "i8")


def _create_cell_data(file: h5py.File, root: h5py.Group, contents: Contents, capacity: int) -> None:
    """Bond arrays as cell data: VTK wants all vertices first, then the lines; vertices get the fill value.

    Two virtual steps: (T, B) padded to (capacity, N+B), then flattened. One step with a strided selection
    takes VTK 0.2 s a frame to read at a capacity of 2,500 frames and minutes at 25,000; two take 2 ms.
    """
    data, offsets = root.create_group("CellData"), root["Steps"].create_group("CellDataOffsets")
    if not contents.n_bonds:
        return
    padded = file.create_group("beltsim/cells")
    for name, dataset in file["beltsim/bonds"].items():
        _padded(padded, name, dataset, contents.slots, capacity)
        _flattened(data, name, padded[name], capacity)
        offsets[name] = np.arange(capacity, dtype="i8") * (contents.slots + contents.n_bonds)


def _flattened(group: h5py.Group, name: str, source: h5py.Dataset, capacity: int) -> None:
    """View of (T, N, ...) as (capacity*N, ...)."""
    import h5py

    rows, *columns = source.shape[1:]
    layout = h5py.VirtualLayout((capacity * rows, *columns), dtype=source.dtype)
    layout[...] = h5py.VirtualSource(
        ".", source.name, (capacity, *source.shape[1:]), maxshape=source.maxshape
    )
    group.create_virtual_dataset(name, layout, fillvalue=empty_value(source.dtype))


def _padded(group: h5py.Group, name: str, source: h5py.Dataset, slots: int, capacity: int) -> None:
    """View of (T, B) as (capacity, N+B): before the B values of a frame stand N fill values, one a vertex."""
    import h5py

    bonds = source.shape[1]
    layout = h5py.VirtualLayout((capacity, slots + bonds), dtype=source.dtype)
    layout[:, slots:] = h5py.VirtualSource(".", source.name, (capacity, bonds), maxshape=source.maxshape)
    group.create_virtual_dataset(name, layout, fillvalue=empty_value(source.dtype))
