"""What a run tells while it goes on."""

import pytest

from beltsim import progress
from beltsim.progress import PlainLines, sentence
from beltsim.run import Progress


def state(time, end, wall=2.0):
    return Progress(time, end, steps=100, particles=50, wall=wall, fastest=3.14159, particle_steps=1e6)


def test_a_line_says_time_share_speed_and_what_remains():
    """The remaining time is the wall time so far, scaled."""
    assert (
        sentence(state(0.5, 2.0, wall=20.0))
        == "t=0.50/2.00 s  25%  50 particles  5e+04 particle-steps/s  ETA 60 s  max|v|=3.1 m/s"
    )


@pytest.mark.parametrize(
    ("end", "shown"),
    [(120.0, "t=60.00/120.00"), (0.05, "t=0.0250/0.0500"), (1e-6, "t=0.00000050/0.00000100")],
)
def test_short_runs_show_their_hundredth_part(end, shown):
    """A run of 50 ms would else be at 0.00 or 0.05 s all the time."""
    assert sentence(state(0.5 * end, end)).startswith(shown)


def test_lines_come_by_tenths_but_not_faster_than_one_can_read(monkeypatch, capsys):
    """A run that is over in a moment prints none; a slow one a line a minute."""
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    lines = PlainLines()
    for share in (0.2, 0.5, 1.0):
        lines(state(share, 1.0))
    assert capsys.readouterr().err == ""
    lines = PlainLines()
    for second, share in ((2.0, 0.05), (4.0, 0.12), (10.0, 0.15), (65.0, 0.16)):
        clock[0] = second
        lines(state(share, 1.0))
    assert [line.split()[2] for line in capsys.readouterr().err.splitlines()] == ["12%", "16%"]
