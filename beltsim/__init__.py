"""Dynamic conveyor-belt simulation with bonded-particle belts."""

__version__ = "0.1.0"
