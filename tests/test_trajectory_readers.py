"""Others' readers see in a trajectory what h5py sees: VTK (ParaView's own reader) and MDAnalysis."""

import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
from trajectory_scenes import SCENES, SLOTS, make_contents, make_frame, make_frames, write

from beltsim import trajectory
from beltsim.trajectory import TrajectoryWriter

vtk_hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
from vtkmodules.util.numpy_support import vtk_to_numpy  # noqa: E402

with warnings.catch_warnings():
    # MDAnalysis and what it imports warn about their own deprecations.
    warnings.simplefilter("ignore")
    MDAnalysis = pytest.importorskip("MDAnalysis")


class Vtk:
    """One frame as vtkHDFReader gives it."""

    def __init__(self, path, t):
        reader = vtk_hdf.vtkHDFReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        self.frames = reader.GetNumberOfSteps()
        reader.SetStep(t)
        reader.Update()
        self.time = reader.GetTimeValue()
        self.output = reader.GetOutput()
        self.points = vtk_to_numpy(self.output.GetPoints().GetData())
        self.vertices = vtk_to_numpy(self.output.GetVerts().GetConnectivityArray())
        self.lines = vtk_to_numpy(self.output.GetLines().GetConnectivityArray()).reshape(-1, 2)
        self.point_data = arrays(self.output.GetPointData())
        self.cell_data = arrays(self.output.GetCellData())


def arrays(data):
    return {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}


def open_mdanalysis(path):
    universe = MDAnalysis.Universe.empty(SLOTS)
    return universe.load_new(str(path), format="H5MD", convert_units=False)


@pytest.mark.parametrize("scene", SCENES)
def test_vtk_sees_the_same_frames_in_any_order(tmp_path, scene):
    contents = make_contents(**SCENES[scene])
    path = write(tmp_path, contents, make_frames(contents))
    with trajectory.read(path) as found:
        for t in (4, 0, 2, 1, 3):
            frame, seen = found[t], Vtk(path, t)
            assert seen.frames == 5
            assert seen.time == frame.time
            np.testing.assert_array_equal(seen.points, frame.position)
            np.testing.assert_array_equal(seen.vertices, np.arange(frame.active))
            np.testing.assert_array_equal(seen.lines, contents.bonds)
            assert {"id", "species", "mass", "half_extent", "velocity", "orientation"} <= set(seen.point_data)
            for name, values in seen.point_data.items():
                field = "species_of" if name == "species" else name
                np.testing.assert_array_equal(values, getattr(frame, field), err_msg=name)


@pytest.mark.parametrize("scene", SCENES)
def test_vtk_sees_bond_data_on_the_lines_after_the_vertices(tmp_path, scene):
    contents = make_contents(**SCENES[scene])
    path = write(tmp_path, contents, make_frames(contents))
    with trajectory.read(path) as found:
        for t in range(5):
            frame, seen = found[t], Vtk(path, t)
            assert seen.cell_data.keys() == frame.bonds.keys()
            for name, values in seen.cell_data.items():
                assert len(values) == frame.active + contents.n_bonds
                np.testing.assert_array_equal(values[frame.active :], frame.bonds[name], err_msg=name)


@pytest.mark.parametrize("scene", SCENES)
def test_mdanalysis_sees_the_same_frames(tmp_path, scene):
    contents = make_contents(**SCENES[scene])
    path = write(tmp_path, contents, make_frames(contents))
    with trajectory.read(path) as found:
        universe = open_mdanalysis(path)
        assert universe.trajectory.n_frames == 5
        for frame in found:
            moment = universe.trajectory[round(frame.step / 100)]
            assert (moment.time, moment.data["step"]) == (frame.time, frame.step)
            assert moment.data["energy"] == frame.observables["energy"]
            # MDAnalysis holds float32.
            for seen, own in (
                (moment.positions, frame.position),
                (moment.velocities, frame.velocity),
                (moment.forces, frame.force),
            ):
                np.testing.assert_array_equal(seen[: frame.active], own.astype("f4"))
    universe.trajectory.close()


def test_a_single_frame_opens_everywhere(tmp_path):
    for dynamic in (False, True):
        contents = make_contents(dynamic=dynamic)
        frame = make_frame(contents, 0)
        path = write(tmp_path, contents, [frame], f"{dynamic}.h5")
        np.testing.assert_array_equal(Vtk(path, 0).points, frame.position.astype("f4"))
        universe = open_mdanalysis(path)
        np.testing.assert_array_equal(universe.atoms.positions, frame.position.astype("f4"))
        universe.trajectory.close()


def test_the_readers_see_each_frame_as_soon_as_it_is_written(tmp_path):
    contents = make_contents(dynamic=True)
    path = tmp_path / "run.h5"
    with TrajectoryWriter(path, contents, planned_frames=4) as writer:
        for t, frame in enumerate(make_frames(contents)):
            writer.append(frame)
            seen = Vtk(path, t)
            assert seen.frames == t + 1
            np.testing.assert_array_equal(seen.points, frame.position.astype("f4"))


def test_a_long_plan_costs_the_readers_nothing_to_see(tmp_path):
    # A strided view of the bonds took VTK minutes a frame at this capacity, and a billion bytes if it were stored.
    contents = make_contents()
    path = tmp_path / "run.h5"
    with TrajectoryWriter(path, contents, planned_frames=100_000) as writer:
        writer.append(make_frame(contents, 0))
    np.testing.assert_array_equal(Vtk(path, 0).lines, contents.bonds)


ENDLESS_RUN = """
import itertools, sys
from trajectory_scenes import make_contents, make_frame
from beltsim.trajectory import TrajectoryWriter
contents = make_contents(dynamic=True, compress=sys.argv[2] == "compressed")
with TrajectoryWriter(sys.argv[1], contents, planned_frames=1_000_000) as writer:
    for t in itertools.count():
        writer.append(make_frame(contents, t, active=6 + t % 7))
        print(t, flush=True)
"""


def kill_a_run(path, packing, after):
    """Start an endless run, kill it; returns how many frames it says it has written."""
    command = [sys.executable, "-c", ENDLESS_RUN, str(path), packing]
    here = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=here) as run:
        run.stdout.readline()
        time.sleep(after)
        run.send_signal(signal.SIGKILL)
        lines = run.stdout.read().splitlines()
    return 1 + (int(lines[-1]) if lines else 0)


@pytest.mark.parametrize("packing", ["plain", "compressed"])
@pytest.mark.parametrize("after", [0.03, 0.25])
def test_a_killed_run_opens_everywhere_and_no_frame_is_lost(tmp_path, packing, after):
    path = tmp_path / "run.h5"
    written = kill_a_run(path, packing, after)
    with h5py.File(path) as file:
        # VTK writes beyond its buffer if there are more times than it counts frames.
        assert len(file["VTKHDF/Steps/Values"]) <= file["VTKHDF/Steps"].attrs["NSteps"]
    with trajectory.read(path) as found:
        assert len(found) >= written
        last = len(found) - 1
        expected = make_frame(found.contents, last, active=6 + last % 7).position.astype("f4")
        np.testing.assert_array_equal(found[last].position, expected)
    np.testing.assert_array_equal(Vtk(path, last).points, expected)
    universe = open_mdanalysis(path)
    universe.trajectory[last]
    np.testing.assert_array_equal(universe.atoms.positions[: 6 + last % 7], expected)
    universe.trajectory.close()
