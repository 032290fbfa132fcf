"""Where a picture is taken from: a direction, a frame around what must be seen, and a plane that opens the view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .errors import ViewProblem

AXES = ("x", "y", "z")
FAR = 1e30


@dataclass(frozen=True)
class Camera:
    """A wish for a view; what is left out is chosen from the scenery.

    Azimuth: angle in deg in the horizontal plane from +x to the camera (None: three-quarter view of the longer
    side, or of a section). Elevation: angle in deg above the horizon. Zoom: the box x0, y0, z0, x1, y1, z1 in m
    that fills the picture (None: everything). Orthographic: parallel rays instead of perspective with
    `field_of_view` deg.
    """

    azimuth: float | None = None
    elevation: float = 24.0
    zoom: tuple[float, ...] | None = None
    orthographic: bool = False
    field_of_view: float = 24.0

    def __post_init__(self):
        if self.azimuth is not None and not np.isfinite(self.azimuth):
            raise ViewProblem(f"azimuth: found {self.azimuth}, expected a finite angle in degrees")
        if not -90 <= self.elevation <= 90:
            raise ViewProblem(f"elevation: found {self.elevation:g}, expected -90 to 90 degrees")
        if self.zoom is not None and not (
            len(self.zoom) == 6 and np.all(np.subtract(self.zoom[3:], self.zoom[:3]) > 0)
        ):
            raise ViewProblem(f"zoom: found {self.zoom}, expected x0,y0,z0,x1,y1,z1 with x0<x1, y0<y1, z0<z1")


@dataclass(frozen=True)
class Section:
    """A plane across one axis: what lies between it and the camera is not drawn, and what it cuts is seen cut."""

    axis: int
    value: float

    @classmethod
    def parse(cls, text: str) -> Section:
        """The section of a text as `x=1.2` (m)."""
        name, _, value = text.partition("=")
        try:
            section = cls(AXES.index(name.strip().lower()), float(value))
            if not np.isfinite(section.value):
                raise ValueError
            return section
        except ValueError:
            raise ViewProblem(f"section: found {text!r}, expected one as x=1.2, y=0 or z=0.5 (m)") from None

    def facing(self, camera: Camera) -> Camera:
        """The camera, turned to face the plane at 25 deg if it may look from anywhere."""
        if camera.azimuth is not None or self.axis == 2:
            return camera
        return replace(camera, azimuth=(-25.0, -65.0)[self.axis])

    def left(self, back: np.ndarray) -> HalfSpace:
        """What the section leaves to see from the direction `back` (3,) of the camera."""
        if abs(back[self.axis]) < 1e-3:
            raise ViewProblem(
                f"section: found {AXES[self.axis]}={self.value:g} seen edge-on, expected another azimuth or elevation"
            )
        return HalfSpace(self.axis, self.value, float(np.sign(back[self.axis])))


@dataclass(frozen=True)
class HalfSpace:
    """What is left to see: `side` * (coordinate `axis` - `value`) <= 0, `side` being +1 or -1."""

    axis: int
    value: float
    side: float

    def normal(self) -> np.ndarray:
        """The unit normal (3,), out of what is left."""
        return self.side * np.eye(3)[self.axis]

    def cut(self, solids: np.ndarray) -> np.ndarray:
        """The corners (m, k, 3) of the solids (n, k, 3) that are not wholly hidden, drawn back to the plane."""
        beyond = self.side * (solids[..., self.axis] - self.value)
        seen = beyond.min(axis=1) <= 0
        return solids[seen] - np.clip(beyond[seen], 0, None)[..., None] * self.normal()

    def interval(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where rays (n, 3) enter and leave what is left: distances (n,) in m, 0 and 0 if they never do."""
        depth = self.side * (self.value - origin[:, self.axis])
        speed = self.side * direction[:, self.axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = depth / speed
        outside, inward = depth < 0, speed < 0
        enter = np.where(outside & inward, crossing, 0.0)
        leave = np.where(outside, np.where(inward, FAR, 0.0), np.where(speed > 0, crossing, FAR))
        return enter, leave


@dataclass(frozen=True)
class View:
    """A camera in place: `axes` are the picture's right, its up and the direction back to the camera."""

    eye: np.ndarray
    axes: np.ndarray
    half: np.ndarray  # half width and height: m if orthographic, else tangents of the half angles
    orthographic: bool

    def scale(self, distance: np.ndarray) -> np.ndarray:
        """Half the width in m that the picture shows at distances (n,) in m along the rays."""
        return self.half[0] * (np.ones_like(distance) if self.orthographic else distance)

    def rays(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions (n, 3) of the rays through picture points, -1..1 to the right and up."""
        right, up, back = self.axes
        across = x[:, None] * self.half[0] * right + y[:, None] * self.half[1] * up
        if self.orthographic:
            return self.eye + across, np.tile(-back, (len(x), 1))
        direction = across - back
        return np.tile(self.eye, (len(x), 1)), direction / np.linalg.norm(direction, axis=1, keepdims=True)


def place(camera: Camera, axes, corners, everything, aspect: float, margin: np.ndarray) -> View:
    """Put the camera where all `corners` (n, 3) just fit into the picture.

    `axes`: of `view_axes`. `everything`: box (2, 3) in m of the whole scenery; parallel rays start outside it.
    `margin`: share of the picture kept free at left, right, bottom, top. `aspect`: width over height.
    """
    local = corners @ axes.T
    centre, free = (
        np.array([margin[1] - margin[0], margin[3] - margin[2]]),
        1 - margin.reshape(2, 2).sum(axis=1),
    )
    if camera.orthographic:
        return _place_parallel(axes, local, everything, aspect, centre, free)
    return _place_perspective(axes, local, camera.field_of_view, aspect, centre, free)


def view_axes(camera: Camera, extent: np.ndarray) -> np.ndarray:
    """The picture's right, up and back axes (3, 3) in the world, z up; `extent`: size of the scenery in m."""
    azimuth = camera.azimuth
    if azimuth is None:
        azimuth = -55.0 if extent[0] >= extent[1] else 35.0
    a, e = np.radians([azimuth, camera.elevation])
    back = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.array([right, np.cross(back, right), back])


def _place_parallel(axes, local, everything, aspect, centre, free) -> View:
    low, high = local.min(axis=0), local.max(axis=0)
    reach = np.maximum(np.array(high - low)[:2], 1e-9) / 2 / free
    half = max(reach[0], reach[1] * aspect) * np.array([1.0, 1 / aspect])
    middle = (low + high)[:2] / 2 + centre * half
    box = np.array(np.meshgrid(*everything.T)).reshape(3, 8).T
    depth = (box @ axes[2]).max() + 0.1 * np.linalg.norm(np.ptp(everything, axis=0))
    return View(np.array([*middle, depth]) @ axes, axes, half, True)


def _place_perspective(axes, local, field_of_view, aspect, centre, free) -> View:
    half = np.tan(np.radians(field_of_view) / 2) * np.array([1.0, 1 / aspect]) * min(1.0, aspect)
    eye = np.empty(3)
    # The four sides of the free part of the picture are planes through the eye. Each has an outermost point;
    # two opposite planes through theirs meet at the eye's distance.
    sides, distances = [], []
    for k in range(2):
        upper, lower = half[k] * (free[k] - centre[k]), half[k] * (free[k] + centre[k])
        most = (local[:, k] + upper * local[:, 2]).max()
        least = (-local[:, k] + lower * local[:, 2]).max()
        sides.append((most, least, upper, lower))
        distances.append((most + least) / (upper + lower))
    eye[2] = max(distances)
    for k, (most, least, upper, lower) in enumerate(sides):
        eye[k] = ((most - upper * eye[2]) + (lower * eye[2] - least)) / 2
    return View(eye @ axes, axes, half, False)
