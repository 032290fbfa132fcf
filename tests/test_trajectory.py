"""A trajectory gives back what was written, says what it holds, and refuses what does not fit."""

import dataclasses

import h5py
import numpy as np
import pytest
from trajectory_scenes import SCENES, make_contents, make_frame, make_frames, write

from beltsim import trajectory
from beltsim.trajectory import Frame, TrajectoryError, TrajectoryWriter
from beltsim.trajectory.case_text import shortened

ARRAYS = ("position", "velocity", "orientation", "force", "mass", "radius", "half_extent", "edge_radius")


def assert_same_frame(found: Frame, expected: Frame, contents):
    # float32 keeps 24 bits: relative error at most 2^-24 = 6e-8.
    rtol = 0 if contents.double else 6e-8
    assert (found.step, found.time) == (expected.step, expected.time)
    for name in (*ARRAYS, "species_of", "id"):
        values = getattr(expected, name)
        if values is None:
            values = getattr(contents, name)[: expected.active]
        np.testing.assert_allclose(getattr(found, name), values, rtol=rtol, err_msg=name)
    assert found.bonds.keys() == expected.bonds.keys()
    for name, values in expected.bonds.items():
        np.testing.assert_allclose(found.bonds[name], values, rtol=rtol, err_msg=name)
    for name, values in expected.observables.items():
        np.testing.assert_array_equal(found.observables[name], values)
    for part, quantities in expected.parts.items():
        for name, values in quantities.items():
            np.testing.assert_array_equal(found.parts[part][name], values)


@pytest.mark.parametrize("scene", SCENES)
def test_frames_come_back_as_written(tmp_path, scene):
    contents = make_contents(**SCENES[scene])
    frames = make_frames(contents)
    with trajectory.read(write(tmp_path, contents, frames)) as found:
        assert len(found) == len(frames)
        for one, other in zip(found, frames):
            assert_same_frame(one, other, contents)


@pytest.mark.parametrize("scene", SCENES)
def test_contents_come_back_as_written(tmp_path, scene):
    contents = make_contents(**SCENES[scene])
    with trajectory.read(write(tmp_path, contents, [])) as found:
        for field in dataclasses.fields(contents):
            np.testing.assert_array_equal(
                getattr(found.contents, field.name), getattr(contents, field.name), err_msg=field.name
            )


def test_a_trajectory_is_a_sequence(tmp_path):
    contents = make_contents()
    frames = make_frames(contents)
    with trajectory.read(write(tmp_path, contents, frames)) as found:
        assert found[-1].step == frames[-1].step
        assert [frame.step for frame in found[1:3]] == [frame.step for frame in frames[1:3]]
        assert found.steps.tolist() == [frame.step for frame in frames]
        assert found.times.tolist() == [frame.time for frame in frames]
        np.testing.assert_array_equal(
            found.observable("momentum"), [frame.observables["momentum"] for frame in frames]
        )
        with pytest.raises(IndexError):
            found[len(frames)]


def test_case_and_provenance_come_back(tmp_path):
    path = tmp_path / "run.h5"
    case = b"*FORMAT, NAME=BELTSIM, VERSION=1\n"
    with TrajectoryWriter(path, make_contents(), planned_frames=1, case_text=case, provenance={"seed": 7}):
        pass
    with trajectory.read(path) as found:
        assert found.case_text == case
        assert found.provenance == {"seed": 7}


def test_long_data_blocks_of_a_very_long_case_are_left_out():
    rows = b"".join(b"%d, 0, 0, 0\n" % i for i in range(1000))
    text = b"*PARTICLE, TYPE=a\n" + rows + b"*GRAVITY\n0, 0, -9.81\n"
    assert shortened(text) == text
    expected = b"*PARTICLE, TYPE=a\n** 1000 data lines left out here\n*GRAVITY\n0, 0, -9.81\n"
    assert shortened(text, limit=5000) == expected


def test_empty_slots_hold_nan_and_no_id(tmp_path):
    contents = make_contents(dynamic=True)
    frames = make_frames(contents)
    path = write(tmp_path, contents, frames)
    with h5py.File(path) as file:
        for t, frame in enumerate(frames):
            assert np.isnan(file["particles/all/position/value"][t, frame.active :]).all()
            assert (file["particles/all/id/value"][t, frame.active :] == -1).all()
            assert file["beltsim/active"][t] == frame.active


def test_bonds_are_stored_as_ids_when_ids_are_constant_else_as_slots(tmp_path):
    for dynamic in (False, True):
        contents = make_contents(dynamic=dynamic)
        with h5py.File(write(tmp_path, contents, [], f"{dynamic}.h5")) as file:
            expected = contents.bonds if dynamic else contents.id[contents.bonds]
            np.testing.assert_array_equal(file["connectivity/bonds"], expected)


def test_each_part_has_its_own_view_that_grows(tmp_path):
    contents = make_contents()
    frames = make_frames(contents)
    with h5py.File(write(tmp_path, contents, frames)) as file:
        for name, path in (("head/1", "head%2F1"), ("floor", "floor")):
            value = file[f"parts/{path}/force/value"]
            np.testing.assert_array_equal(value, [frame.parts[name]["force"] for frame in frames])
            assert file[f"parts/{path}/force/time"] == file["particles/all/position/time"]
        assert file["parts/head%2F1"].attrs["class"] == "PULLEY"


def test_only_the_chosen_fields_are_written(tmp_path):
    contents = dataclasses.replace(make_contents(), fields=frozenset({"VELOCITY"}))
    with h5py.File(write(tmp_path, contents, [])) as file:
        assert "velocity" in file["particles/all"]
        assert "orientation" not in file["particles/all"]
        assert list(file["beltsim/bonds"]) == ["broken"]


def test_double_precision_resolves_a_nanometre_at_a_hundred_metres(tmp_path):
    for double in (False, True):
        contents = make_contents(double=double)
        frame = make_frame(contents, 0)
        frame.position[:] = 100.0 + 1e-9
        with trajectory.read(write(tmp_path, contents, [frame], f"{double}.h5")) as found:
            assert (float(found[0].position[0, 0]) == 100.0 + 1e-9) == double


def break_count(frame):
    frame.position = frame.position[:-1]


def break_shape(frame):
    frame.velocity = frame.velocity[:, :2]


def break_field(frame):
    frame.orientation = None


def break_bond(frame):
    del frame.bonds["axial_force"]


def break_part(frame):
    frame.parts["head/1"]["force"] = np.zeros(4)


def break_observable(frame):
    frame.observables = {}


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (break_count, "found 11 particles, expected 12"),
        (break_shape, r"velocity/value: found shape \(12, 2\), expected shape \(12, 3\)"),
        (break_field, r"orientation/value: found nothing, expected shape \(12, 4\)"),
        (break_bond, "axial_force: found nothing"),
        (break_part, r"part head/1: force: found shape \(4,\), expected shape \(3,\)"),
        (break_observable, "energy/value: found nothing"),
    ],
)
def test_a_frame_that_does_not_fit_is_refused_and_nothing_is_lost(tmp_path, damage, message):
    contents = make_contents()
    good, bad = make_frame(contents, 0), make_frame(contents, 1)
    damage(bad)
    path = tmp_path / "run.h5"
    with TrajectoryWriter(path, contents, planned_frames=3) as writer:
        writer.append(good)
        with pytest.raises(TrajectoryError, match=message):
            writer.append(bad)
        writer.append(make_frame(contents, 2))
    with trajectory.read(path) as found:
        assert found.steps.tolist() == [good.step, make_frame(contents, 2).step]


def test_bonded_particles_must_stay_active(tmp_path):
    contents = make_contents(dynamic=True)
    with (
        TrajectoryWriter(tmp_path / "run.h5", contents, planned_frames=1) as writer,
        pytest.raises(TrajectoryError, match="found 4 particles, expected all that are bonded"),
    ):
        writer.append(make_frame(contents, 0, active=4))


def test_more_frames_than_planned_fit_up_to_the_slack_only(tmp_path):
    contents = make_contents()
    with TrajectoryWriter(tmp_path / "run.h5", contents, planned_frames=2) as writer:
        for t in range(2 + 64):
            writer.append(make_frame(contents, t))
        with pytest.raises(TrajectoryError, match="planned for 66"):
            writer.append(make_frame(contents, 66))


def test_other_files_are_refused(tmp_path):
    text, other = tmp_path / "text.h5", tmp_path / "other.h5"
    text.write_text("no HDF5")
    with h5py.File(other, "w"):
        pass
    with pytest.raises(TrajectoryError, match="found no HDF5 file"):
        trajectory.read(text)
    with pytest.raises(TrajectoryError, match="expected layout 1"):
        trajectory.read(other)
    with pytest.raises(FileNotFoundError):
        trajectory.read(tmp_path / "missing.h5")


def test_the_file_is_read_while_it_grows(tmp_path):
    contents = make_contents()
    path = tmp_path / "run.h5"
    with TrajectoryWriter(path, contents, planned_frames=5) as writer:
        for t in range(5):
            writer.append(make_frame(contents, t))
            with trajectory.read(path) as found:
                assert len(found) == t + 1
                assert_same_frame(found[t], make_frame(contents, t), contents)


# What H5MD 1.1 requires, item by item.


def test_h5md_root_and_creator(tmp_path):
    with h5py.File(write(tmp_path, make_contents(), [])) as file:
        assert file["h5md"].attrs["version"].tolist() == [1, 1]
        for group, names in (("author", ["name"]), ("creator", ["name", "version"])):
            for name in names:
                assert isinstance(file["h5md"][group].attrs[name], str)


def test_h5md_box_without_bounds(tmp_path):
    with h5py.File(write(tmp_path, make_contents(), [])) as file:
        box = file["particles/all/box"]
        assert box.attrs["dimension"] == 3
        assert box.attrs["boundary"].tolist() == [b"none"] * 3
        assert "edges" not in box


@pytest.mark.parametrize("scene", SCENES)
def test_h5md_elements_have_value_step_and_time_of_one_length(tmp_path, scene):
    contents = make_contents(**SCENES[scene])
    frames = make_frames(contents)
    with h5py.File(write(tmp_path, contents, frames)) as file:
        position = file["particles/all/position"]
        elements = [element for name, element in file["particles/all"].items() if name != "box"]
        elements += file["observables"].values()
        for element in elements:
            if isinstance(element, h5py.Dataset):
                assert len(element) == contents.slots
                continue
            assert set(element) == {"step", "time", "value"}
            assert len(element["value"]) == len(element["step"]) == len(element["time"]) == len(frames)
            assert element["step"] == position["step"]
            assert element["time"] == position["time"]
            assert element["time"].attrs["unit"] == "s"
        for name in ("position", "velocity", "force", "orientation"):
            assert file[f"particles/all/{name}/value"].shape[1] == contents.slots


def test_h5md_connectivity_refers_to_its_particles(tmp_path):
    with h5py.File(write(tmp_path, make_contents(), [])) as file:
        reference = file["connectivity/bonds"].attrs["particles_group"]
        assert file[reference] == file["particles/all"]
