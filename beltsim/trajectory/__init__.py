"""The trajectory file: one HDF5 file that is H5MD and VTKHDF at once.

`layout` says what is in it, `writer` appends frames, `vtkhdf` lays ParaView's view over the same bytes,
`reader` gives the frames back. Importing this package does not import h5py.
"""

from beltsim.trajectory.layout import Contents, Frame, PartDescription, TrajectoryError
from beltsim.trajectory.reader import Trajectory, read
from beltsim.trajectory.writer import TrajectoryWriter

__all__ = [
    "Contents",
    "Frame",
    "PartDescription",
    "Trajectory",
    "TrajectoryError",
    "TrajectoryWriter",
    "read",
]
