"""Analytic answers the solver is measured against, as plain functions, and their values for the reference strip.

SI units throughout. The strip: 1 m x 0.1 m x 10 mm of E = 50 MPa, Poisson ratio 0.3, 1200 kg/m3.
"""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Strip:
    """A homogeneous strip of rectangular section; bending is out of its plane."""

    youngs_modulus: float = 50e6
    poisson_ratio: float = 0.3
    density: float = 1200.0
    length: float = 1.0
    width: float = 0.1
    thickness: float = 0.01

    @property
    def shear_modulus(self):
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def area(self):
        return self.width * self.thickness

    @property
    def axial_rigidity(self):
        return self.youngs_modulus * self.area

    @property
    def bending_rigidity(self):
        return self.youngs_modulus * self.width * self.thickness**3 / 12

    @property
    def shear_rigidity(self):
        return 5 / 6 * self.shear_modulus * self.area

    @property
    def mass_per_length(self):
        return self.density * self.area


STRIP = Strip()

# --- statics ------------------------------------------------------------------------------------------------------


def axial_extension(strip, force):
    """A1: F L / EA."""
    return force * strip.length / strip.axial_rigidity


def cantilever_tip(strip, force):
    """B1: P L^3 / 3 EI + P L / kGA (Timoshenko)."""
    bending = strip.length**3 / (3 * strip.bending_rigidity)
    return force * (bending + strip.length / strip.shear_rigidity)


def saint_venant_constant(width, thickness):
    """Torsion constant J of a rectangle, width >= thickness, by its series (Timoshenko and Goodier, art. 109)."""
    odd = np.arange(1, 200, 2)
    series = np.sum(np.tanh(odd * math.pi * width / (2 * thickness)) / odd**5.0)
    return width * thickness**3 / 3 * (1 - 192 / math.pi**5 * thickness / width * series)


def end_twist(strip, torque):
    """C1: T L / G J."""
    constant = saint_venant_constant(strip.width, strip.thickness)
    return torque * strip.length / (strip.shear_modulus * constant)


def roll_up_moment(strip):
    """E2: the end moment 2 pi EI / L that closes a strip to a circle; each of N bonds then turns by 2 pi / N."""
    return 2 * math.pi * strip.bending_rigidity / strip.length


def euler_load(strip):
    """D1: pi^2 EI / 4 L^2, clamped at one end and free at the other."""
    return math.pi**2 * strip.bending_rigidity / (4 * strip.length**2)


def euler_load_of_chain(strip, bonds):
    """D1 for a chain of N rigid halves and bending springs: (4 N^2 EI / L^2) tan^2(pi / 4N)."""
    return 4 * bonds**2 * strip.bending_rigidity / strip.length**2 * math.tan(math.pi / (4 * bonds)) ** 2


# --- frequencies --------------------------------------------------------------------------------------------------


def axial_frequency(strip):
    """A3: c / 4 L, fixed and free end, c = sqrt(E / density)."""
    return math.sqrt(strip.youngs_modulus / strip.density) / (4 * strip.length)


def axial_frequency_of_chain(strip, bonds):
    """A3 for N equal bonds and an end particle of half mass: (c N / pi L) sin(pi / 4N)."""
    return axial_frequency(strip) * 4 * bonds / math.pi * math.sin(math.pi / (4 * bonds))


def cantilever_frequencies(strip):
    """B2: the first three of (beta L)^2 sqrt(EI / rho A) / 2 pi L^2 (Euler-Bernoulli)."""
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    wave = math.sqrt(strip.bending_rigidity / strip.mass_per_length)
    return roots**2 * wave / (2 * math.pi * strip.length**2)


STRIP_VALUES = {
    "axial_extension of 500 N": 0.01,
    "axial_frequency": 51.0310,
    "axial_frequency_of_chain": {10: 50.9786, 20: 51.0179, 40: 51.0278},
    "cantilever_tip of 0.01 N": 8.000624e-3,
    "cantilever_frequencies": (0.329742, 2.066460, 5.786147),
    "cantilever_frequencies, Timoshenko": (0.329716, 2.065311, 5.778486),
    "saint_venant_constant": 3.12325e-8,
    "end_twist of 0.05 N m": 0.0832466,
    "roll_up_moment": 2.617994,
    "euler_load": 1.028084,
    "euler_load_of_chain": {10: 1.032326, 20: 1.029142, 40: 1.028348},
}
"""Independently computed values for the strip, to all digits given."""

# --- impacts ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Impact:
    """A pair that meets head on: reduced radius [m], reduced mass [kg], E* [Pa], closing speed [m/s]."""

    radius: float
    mass: float
    modulus: float
    speed: float

    @property
    def stiffness(self):
        """K of F = K overlap^(3/2)."""
        return 4 / 3 * self.modulus * math.sqrt(self.radius)

    @property
    def largest_overlap(self):
        return (5 * self.mass * self.speed**2 / (4 * self.stiffness)) ** 0.4

    @property
    def largest_force(self):
        return self.stiffness * self.largest_overlap**1.5

    @property
    def duration(self):
        """2.9432 overlap / speed; the number is 2 times the integral of dx / sqrt(1 - x^2.5) from 0 to 1."""
        number = 2 * 0.4 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
        return number * self.largest_overlap / self.speed


def equal_spheres(youngs_modulus, poisson_ratio, density, radius, speed_each):
    """Two equal spheres that meet with `speed_each` from both sides."""
    mass = density * 4 / 3 * math.pi * radius**3
    modulus = youngs_modulus / (1 - poisson_ratio**2) / 2
    return Impact(radius / 2, mass / 2, modulus, 2 * speed_each)


def sphere_on_rigid_wall(youngs_modulus, poisson_ratio, density, radius, speed):
    """A sphere that meets a rigid plane."""
    mass = density * 4 / 3 * math.pi * radius**3
    return Impact(radius, mass, youngs_modulus / (1 - poisson_ratio**2), speed)


CHUNG_OOI_ELASTIC = {
    # name: (impact, largest force [N], largest overlap [m], duration [s])
    "1 glass": (equal_spheres(4.8e10, 0.20, 2800, 0.01, 10), 10696.9, 2.74113e-4, 40.338e-6),
    "1 limestone": (equal_spheres(2.0e10, 0.25, 2500, 0.01, 10), 7108.2, 3.68304e-4, 54.200e-6),
    "2 aluminium": (sphere_on_rigid_wall(7.0e10, 0.30, 2699, 0.1, 0.2), 11369.9, 4.97172e-5, 731.64e-6),
    "2 magnesium": (sphere_on_rigid_wall(4.0e10, 0.35, 1800, 0.1, 0.2), 7232.7, 5.21233e-5, 767.05e-6),
}
"""Tests 1 and 2 of Chung and Ooi (2011), Granular Matter 13, 643."""


def sliding_rebound(speed, angle, restitution, friction, radius):
    """Rebound of a sphere that slides all through an oblique impact, `angle` from the normal.

    Returns the tangential restitution e_t = 1 - mu (1 + e) cot(angle) and the spin 5/2 mu (1 + e) v cos(angle) / R.
    Holds for friction (1 + e) 7/2 < tan(angle), whatever the stiffness.
    """
    impulse = friction * (1 + restitution)
    return 1 - impulse / math.tan(angle), 2.5 * impulse * speed * math.cos(angle) / radius
