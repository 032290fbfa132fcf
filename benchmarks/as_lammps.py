"""A scene of `scenes.py` in the words of LAMMPS (GRANULAR and BPM packages), run in a process of its own.

LAMMPS takes the bonds' free state from where particles are at its first `run`: they are read where all bonds are free,
`run 0` remembers that, and then `set` moves them to the state of the scene. Contacts begin without history, as in
beltsim. The executable is $LMP, or lmp on the PATH.

Its contact laws:
    granular   hertz/material with coeff_restitution damping and mindlin_rescale: beltsim's law, term by term
    hertz      gran/hertz/history: the same springs with damping in proportion to their stiffness; LAMMPS's fastest
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scenes import (
    BELT_DENSITY,
    BELT_RADIUS,
    FRICTION,
    GRAINS,
    GRAVITY,
    IDLER_RADIUS,
    PITCH,
    POISSON,
    RESTITUTION,
    TIME_STEP,
    YOUNG,
    Scene,
    bond_stiffness,
)

SKIN = {"S1": 0.02, "S2": 1.0e-3, "S3": 5.0e-3}  # m, the quickest of some tried
HERTZ_DAMPING = 1.0e6  # 1/(s m), restitution of about a half at 0.3 m/s
TANGENTIAL_SHARE = math.sqrt(2.0 * (1.0 - POISSON) / (2.0 - POISSON))  # sqrt(4 G*/E*), as beltsim damps


@dataclass
class Run:
    """What a run of LAMMPS took and where it ended."""

    seconds: float  # CPU, the timed steps only
    contacts: float  # touching pairs and walls, 0 for scenes without grains
    result: dict[str, np.ndarray]  # as as_deck.result_of, empty unless asked for
    memory: float  # bytes, as LAMMPS counts it
    version: str


def executable() -> str | None:
    """Path of LAMMPS, None if there is none."""
    return os.environ.get("LMP") or shutil.which("lmp")


def law(style: str) -> tuple[str, str]:
    """The pair style of a contact law, and its words for walls."""
    if style == "granular":
        words = (
            f"hertz/material {YOUNG} {RESTITUTION} {POISSON} tangential mindlin_rescale NULL {TANGENTIAL_SHARE} "
            f"{FRICTION} damping coeff_restitution"
        )
        return f"pair_style granular\npair_coeff * * {words}", f"granular {words}"
    normal = 2.0 / 3.0 * YOUNG / (1.0 - POISSON**2)  # 4/3 E* of two equal bodies
    tangential = 2.0 * YOUNG / ((1.0 + POISSON) * (2.0 - POISSON))  # 8 G*
    words = f"{normal} {tangential} {HERTZ_DAMPING} {0.5 * HERTZ_DAMPING} {FRICTION} 1"
    return f"pair_style gran/hertz/history {words}\npair_coeff * *", f"hertz/history {words}"


def bonds_and_neighbours(scene: Scene, style: str) -> str:
    """The lines on forces between particles."""
    lines = [f"neighbor {SKIN[scene.name]} bin", "neigh_modify every 1 delay 0 check yes"]
    lines.append(law(style)[0] if np.any(scene.kind == GRAINS) else "pair_style none")
    if len(scene.bonds):
        k = bond_stiffness()
        names = ("normal", "shear", "twist", "bend")
        stiffness = " ".join(str(k[name]) for name in names)
        damping = " ".join(str(k[f"{name}_damping"]) for name in names)
        lines += [
            "bond_style bpm/rotational break no smooth no",
            f"bond_coeff 1 {stiffness} 1 1 1 1 {damping}",
        ]
    return "\n".join(lines)


def walls_and_motion(scene: Scene, style: str) -> str:
    """The lines on groups, walls and integration."""
    _, wall = law(style)
    lines = ["group belt type 1 2", "group grains type 3", "group free type 1 3", "group bent type 1"]
    if len(scene.rest):
        lines += ["neigh_modify exclude group belt belt", "fix bent bent nve/bpm/sphere"]
    if np.any(scene.kind == GRAINS):
        lines.append("fix grains grains nve/sphere")
    lines.append(f"fix weight free gravity {GRAVITY} vector 0 0 -1")
    for axis in sorted({axis for axis, _, _ in scene.walls}):
        places = {side: place for name, place, side in scene.walls if name == axis}
        both = " ".join(str(places.get(side, "NULL")) for side in (-1, 1))
        lines.append(f"fix wall{axis} grains wall/gran {wall} {axis}plane {both}")
    smooth = (
        f"granular hertz/material {YOUNG} {RESTITUTION} {POISSON} tangential linear_nohistory 0 0 "
        "damping coeff_restitution"
    )
    z = -(BELT_RADIUS + IDLER_RADIUS)
    for n, x in enumerate(scene.idlers):
        lines.append(f"region idler{n} cylinder y {x} {z} {IDLER_RADIUS} -0.5 {scene.width + 0.5} side out")
        lines.append(f"fix idler{n} belt wall/gran/region {smooth} region idler{n}")
    return "\n".join(lines)


def moved(scene: Scene) -> tuple[dict, str]:
    """Columns of the state, and lines that move the particles to it from where bonds are free."""
    columns = {
        "x": scene.position[:, 0], "y": scene.position[:, 1], "z": scene.position[:, 2],
        "vx": scene.velocity[:, 0], "vy": scene.velocity[:, 1], "vz": scene.velocity[:, 2],
    }  # fmt: skip
    turned = np.sign(scene.orientation[:, :1]) * scene.orientation
    sine = np.linalg.norm(turned[:, 1:], axis=1)
    angle = 2.0 * np.degrees(np.arctan2(sine, turned[:, 0]))
    # LAMMPS wants an axis of unit length and does not say so when it is not.
    axis = (
        np.where(sine[:, None] > 0.0, turned[:, 1:], (0.0, 0.0, 1.0))
        / np.where(sine > 0.0, sine, 1.0)[:, None]
    )
    columns |= {"qa": axis[:, 0], "qb": axis[:, 1], "qc": axis[:, 2], "qt": angle}
    columns |= {"wx": scene.spin[:, 0], "wy": scene.spin[:, 1], "wz": scene.spin[:, 2]}
    return columns, "\n".join(
        [f"variable {name} atomfile {name}.txt" for name in columns]
        + ["set group all x v_x y v_y z v_z", "set group all vx v_vx vy v_vy vz v_vz"]
        + ["set group all omega v_wx v_wy v_wz", "set group belt quat v_qa v_qb v_qc v_qt"]
    )


def data_file(scene: Scene, path: Path) -> None:
    """Particles where bonds are free, and the bonds."""
    n, m = scene.count, len(scene.bonds)
    bonded = bool(m)
    places = scene.position.copy()
    places[: len(scene.rest)] = scene.rest
    both = np.vstack([places, scene.position])
    margin = 1.0 if bonded else 0.01  # m; cells of the neighbour search fill the box
    low, high = both.min(axis=0) - margin, both.max(axis=0) + margin
    style = "bpm/sphere" if bonded else "sphere"
    head = [scene.name, "", f"{n} atoms", "3 atom types"]
    if bonded:
        head += [f"{m} bonds", "1 bond types", "4 extra bond per atom", "8 extra special per atom"]
    head += [f"{a} {b} {c}lo {c}hi" for a, b, c in zip(low, high, "xyz")] + ["", f"Atoms # {style}", ""]
    density = np.where(scene.kind == GRAINS, scene.grain_density, BELT_DENSITY)
    ids, kind = np.arange(1, n + 1), 1 + scene.kind
    columns = [ids, *([np.ones(n)] if bonded else []), kind, 2.0 * scene.radius, density, *places.T]
    integers = 3 if bonded else 2
    with path.open("w") as file:
        file.write("\n".join(head) + "\n")
        np.savetxt(file, np.column_stack(columns), fmt=["%d"] * integers + ["%.15g"] * 5)
        if bonded:
            file.write("\nBonds\n\n")
            np.savetxt(file, np.column_stack([np.arange(1, m + 1), np.ones(m), scene.bonds + 1]), fmt="%d")


def input_of(scene: Scene, style: str, warm: int, steps: int, dump: bool) -> tuple[dict, str]:
    """Columns for `set`, and the input script."""
    columns, set_state = moved(scene)
    bonded = len(scene.bonds) > 0
    if not bonded:
        set_state = "\n".join(line for line in set_state.splitlines() if "quat" not in line)
    head = f"""units si
atom_style {"bpm/sphere" if bonded else "sphere"}
boundary f f f
newton off
comm_modify mode single cutoff {2.2 * PITCH if bonded else 0.0} vel yes
"""
    if bonded:
        head += "special_bonds lj 0.0 1.0 1.0 coul 0.0 1.0 1.0\natom_modify map array\n"
    else:
        head += "atom_modify map array\n"
    out = "id x y z vx vy vz omegax omegay omegaz" + (" c_q[1] c_q[2] c_q[3] c_q[4]" if bonded else "")
    touching = np.any(scene.kind == GRAINS)
    text = f"""{head}read_data data.txt
{bonds_and_neighbours(scene, style)}
{walls_and_motion(scene, style)}
timestep {TIME_STEP}
thermo_modify lost error norm no
run 0
{set_state}
{"compute touch all contact/atom" if touching else ""}
{"compute touches all reduce sum c_touch" if touching else ""}
{"compute q all property/atom quatw quati quatj quatk" if bonded else ""}
run {warm}
run {steps}
{"thermo_style custom step c_touches" if touching else ""}
run 0
{f"write_dump all custom out.txt {out} modify sort id format float %.15g" if dump else ""}
"""
    return columns, text


def run(scene: Scene, style: str, warm: int, steps: int, *, dump: bool = False, core: int = 0) -> Run:
    """Run a scene in LAMMPS on one core.

    Raises
    ------
    RuntimeError
        With the end of its log if it fails.
    """
    columns, text = input_of(scene, style, warm, steps, dump)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        data_file(scene, folder / "data.txt")
        for column, values in columns.items():
            head = f"{values.size}\n"
            rows = "\n".join(f"{n} {value:.17g}" for n, value in enumerate(values.tolist(), start=1))
            (folder / f"{column}.txt").write_text(head + rows + "\n")
        (folder / "in.txt").write_text(text)
        command = ["taskset", "-c", str(core), executable(), "-in", "in.txt", "-log", "log.txt"]
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        done = subprocess.run(
            [*command, "-screen", "none", "-nc"], cwd=folder, env=environment, capture_output=True, text=True
        )
        log = (folder / "log.txt").read_text() if (folder / "log.txt").exists() else ""
        if done.returncode or "ERROR" in log:
            raise RuntimeError(f"LAMMPS failed on {scene.name}:\n{done.stderr[-2000:]}\n{log[-2000:]}")
        result = read_dump(folder / "out.txt") if dump else {}
    return Run(
        cpu_seconds(log, steps),
        touching_pairs(log),
        result,
        memory(log),
        re.search(r"\((.*)\)", log)[1],
    )


def cpu_seconds(log: str, steps: int) -> float:
    """CPU seconds of the timed run: its wall time times the share of a core that it had."""
    for part in log.split("Loop time of")[1:]:
        loop = re.match(r" ([\d.eE+-]+) on \d+ procs for (\d+) steps", part)
        if int(loop[2]) == steps:
            found = float(loop[1]) * min(1.0, float(re.search(r"([\d.]+)% CPU use", part)[1]) / 100.0)
    return found


def memory(log: str) -> float:
    """Bytes of the last run, as LAMMPS counts them."""
    found = re.findall(r"Per MPI rank memory allocation \(min/avg/max\) = ([\d.]+)", log)
    return float(found[-1]) * 2**20


def touching_pairs(log: str) -> float:
    """How many pairs of particles touch at the end, from the contacts that each particle counts."""
    found = re.search(r"Step\s+c_touches\s+\d+\s+(\S+)", log)
    return 0.5 * float(found[1]) if found else 0.0


def read_dump(path: Path) -> dict[str, np.ndarray]:
    """Columns of a dump in the order of the ids."""
    rows = np.loadtxt(path, skiprows=9)
    found = {"position": rows[:, 1:4], "velocity": rows[:, 4:7], "spin": rows[:, 7:10]}
    return found | ({"orientation": rows[:, 10:14]} if rows.shape[1] > 10 else {})
