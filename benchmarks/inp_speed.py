"""Seconds to write and to read one million *PARTICLE and *BOND rows, all checks included, on one core.

Printed beside the time of numpy's own C parser on the same text, which nothing built on it can beat.

    python benchmarks/inp_speed.py [rows]
"""

import io
import resource
import sys
import time

import numpy as np

from beltsim import inp


def quaternions(random, n):
    values = random.normal(size=(n, 4))
    return values / np.linalg.norm(values, axis=1)[:, None]


def particle_deck(n):
    random = np.random.default_rng(1)
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("MATERIAL", name="rubber", density=1200, youngs_modulus=5e6, poisson_ratio=0.45)
    deck.add("PARTICLE TYPE", name="fibre", shape="SPHERE", radius=0.01, material="rubber")
    rows = {
        "id": np.arange(1, n + 1),
        "position": random.normal(size=(n, 3)),
        "orientation": quaternions(random, n),
    }
    deck.add("PARTICLE", type="fibre", rows=rows)
    return deck


def bond_deck(n):
    random = np.random.default_rng(2)
    deck = inp.Deck()
    deck.add("BOND TYPE", name="cord", radius=0.01, youngs_modulus=4e8, poisson_ratio=0.3)
    first = random.permutation(n) + 1
    rows = {
        "particles": np.column_stack([first, first + 1]),
        "position_1": random.normal(size=(n, 3)),
        "orientation_1": quaternions(random, n),
        "position_2": random.normal(size=(n, 3)),
        "orientation_2": quaternions(random, n),
    }
    deck.add("BOND", type="cord", rows=rows)
    return deck


def timed(function, *arguments):
    start = time.process_time()
    result = function(*arguments)
    return time.process_time() - start, result


def bare_parser(text):
    rows = b"\n".join(line for line in text.split(b"\n") if not line.startswith(b"*"))
    return timed(lambda: np.loadtxt(io.BytesIO(rows), delimiter=",", comments=None))[0]


def report(name, deck):
    write_time, text = timed(inp.dumps, deck)
    read_time, again = timed(inp.read_text, text)
    if again != deck:
        raise SystemExit(f"{name}: what was read differs from what was written")
    bare = bare_parser(text)
    print(
        f"{name:10} {len(text) / 1e6:6.0f} MB   write {write_time:5.2f} s   read {read_time:5.2f} s   "
        f"bare numpy.loadtxt {bare:5.2f} s   ratio {read_time / bare:4.2f}"
    )


if __name__ == "__main__":
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    print(f"{rows} rows, CPU seconds")
    report("*PARTICLE", particle_deck(rows))
    report("*BOND", bond_deck(rows))
    print(
        f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB, generation and texts included"
    )
