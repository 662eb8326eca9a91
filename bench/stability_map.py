#!/usr/bin/env python3
"""Stability maps: cotouch beside a NumPy program, in turns, on the same machine.

The NumPy program is what a user of NumPy would write for the built-in scene single-axis (distributed): the masses under
zero-order hold in closed form, all couplers closed over a tick, the tick's map to the power of the ticks per network
period, the samples in flight as states, numpy.linalg.eigvals, and the largest absolute value but for the eigenvalue
nearest 1 (the rigid-body pole). It comes in two kinds: point by point, and for stacks of points at once; both on one
process or on all cores. The better of them is what cotouch is compared with.

The times of cotouch are of the whole process, with reading the scene and writing the JSON; those of NumPy are of the
computation alone. Verdicts must be equal, radii within 1e-9.

    python3 -m venv .venv && .venv/bin/pip install numpy
    cargo build --release
    .venv/bin/python bench/stability_map.py --cotouch target/release/cotouch
"""

import os

# One thread a process: matrices are small, and processes are what shares the cores.
for library in ("OPENBLAS", "MKL", "OMP"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import argparse
import json
import multiprocessing
import statistics
import subprocess
import sys
import time

import numpy as np

CONTROL_HZ, TICKS = 1024.0, 8
HAND_KG, OBJECT_KG = 0.1, 0.4
B_OWN, B_REMOTE, K_COPIES, B_COPIES = 20.0, 2.0, 300.0, 10.0
KEYS = ("coupling.hand_object.stiffness_n_per_m", "coupling.remote_hand_object.stiffness_n_per_m")
RANGES = ((25.0, 6000.0), (5.0, 1500.0))
CASES = {
    "2 users, n = 1, 16 states": (2, 1),
    "8 users, n = 1, 64 states": (8, 1),
    "2 users, n = 7, 64 states": (2, 7),
}
STACK = 1000  # points at once: more need memory, not less time


def hold(mass_kg):
    """x⁺ and v⁺ of a free mass, per (x, v) and per force."""
    t = 1.0 / CONTROL_HZ
    return np.array([[1.0, t], [0.0, 1.0]]), np.array([t * t / 2, t]) / mass_kg


def maps(points, users, n):
    """One-period maps of a stack of points (k_own, k_remote): (points, 4·users·(1 + n), same)."""
    count, own = len(points), 4 * users
    k_own, k_remote = points[:, 0], points[:, 1]
    (a_hand, b_hand), (a_object, b_object) = hold(HAND_KG), hold(OBJECT_KG)
    # A tick on (states, held samples): states are hand x, v, object x, v of every host.
    tick = np.zeros((count, 2 * own, 2 * own))
    tick[:, range(own, 2 * own), range(own, 2 * own)] = 1.0
    others = users - 1
    for i in range(users):
        hand, body = slice(4 * i, 4 * i + 2), slice(4 * i + 2, 4 * i + 4)
        tick[:, hand, hand] = a_hand
        tick[:, body, body] = a_object
        gain = np.stack([k_own, np.full(count, B_OWN)], axis=1)
        remote = np.stack([k_remote, np.full(count, B_REMOTE)], axis=1)
        copies = np.array([K_COPIES, B_COPIES])
        on_hand = b_hand[None, :, None] * gain[:, None, :]
        on_body = b_object[None, :, None] * gain[:, None, :]
        of_remote = b_object[None, :, None] * remote[:, None, :]
        of_copies = b_object[:, None] * copies[None, :]
        tick[:, hand, body] += on_hand
        tick[:, hand, hand] -= on_hand
        tick[:, body, hand] += on_body
        tick[:, body, body] -= on_body + others * (of_remote + of_copies)
        for j in range(users):
            if j != i:
                tick[:, body, own + 4 * j : own + 4 * j + 2] += of_remote
                tick[:, body, own + 4 * j + 2 : own + 4 * j + 4] += of_copies
    period = np.linalg.matrix_power(tick, TICKS)
    size = own * (1 + n)
    whole = np.zeros((count, size, size))
    whole[:, :own, :own] = period[:, :own, :own]
    whole[:, :own, size - own :] = period[:, :own, own:]
    for row in range(own, size):
        whole[:, row, row - own] = 1.0
    return whole


def radii_of(values):
    """Largest absolute value without the one nearest 1, along the last axis."""
    values = np.array(values)
    nearest = np.argmin(np.abs(values - 1.0), axis=-1)
    np.put_along_axis(values, nearest[..., None], 0.0, axis=-1)
    return np.abs(values).max(axis=-1)


def stacked(job):
    points, users, n = job
    stacks = range(0, len(points), STACK)
    return np.concatenate([radii_of(np.linalg.eigvals(maps(points[i : i + STACK], users, n))) for i in stacks])


def one_by_one(job):
    points, users, n = job
    return np.array([radii_of(np.linalg.eigvals(maps(point[None], users, n)[0])) for point in points])


def numpy_map(kind, points, users, n, pool, processes):
    if pool is None:
        return kind((points, users, n))
    parts = np.array_split(points, 4 * processes)
    return np.concatenate(pool.map(kind, [(part, users, n) for part in parts]))


def cotouch_map(program, size, users, n):
    sweeps = [f"{key}={low}..{high}:{size}" for key, (low, high) in zip(KEYS, RANGES)]
    command = [program, "analyze", "stability", "single-axis", "--json", "--radius"]
    command += [word for sweep in sweeps for word in ("--sweep", sweep)]
    command += ["--set", f"session.users={users}", "--set", f"link.delay_periods={n}"]
    done = subprocess.run(command, capture_output=True, check=True)
    return done.stdout


def timed(function, *arguments):
    start = time.perf_counter()
    answer = function(*arguments)
    return time.perf_counter() - start, answer


def check(document, radii, size):
    """The largest difference of radii; verdicts must be equal."""
    radii = radii.reshape(size, size)
    found = json.loads(document)
    theirs = np.array(found["spectral_radius"], dtype=float)
    difference = np.max(np.abs(theirs - radii) / radii)
    wrong = np.sum((np.array(found["stable"]) != (radii < 1.0)) & (np.abs(radii - 1.0) > 1e-9))
    if wrong or not difference <= 1e-9:
        sys.exit(f"{wrong} verdicts differ; radii differ by up to {difference:.1e}")
    return difference


def compare(name, arguments, pool):
    users, n = CASES[name]
    axes = [np.linspace(low, high, arguments.size) for low, high in RANGES]
    x, y = np.meshgrid(*axes)
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    programs = {"stacked, all cores": (stacked, pool), "stacked, one core": (stacked, None)}
    if not arguments.quick:
        programs["one by one, all cores"] = (one_by_one, pool)
        programs["one by one, one core"] = (one_by_one, None)
    times = {who: [] for who in ("cotouch", *programs)}
    for _ in range(arguments.rounds):
        spent, document = timed(cotouch_map, arguments.cotouch, arguments.size, users, n)
        times["cotouch"].append(spent)
        for who, (kind, workers) in programs.items():
            spent, radii = timed(numpy_map, kind, points, users, n, workers, arguments.processes)
            times[who].append(spent)
    difference = check(document, radii, arguments.size)
    median = {who: statistics.median(spent) for who, spent in times.items()}
    best = min((who for who in programs), key=median.get)
    print(f"{name}, {arguments.size}×{arguments.size}, {arguments.rounds} rounds")
    for who, spent in times.items():
        print(f"  {who:24} median {median[who]:8.3f} s   {min(spent):.3f} to {max(spent):.3f} s")
    ratio = median[best] / median["cotouch"]
    print(f"  cotouch is {ratio:.1f} times as fast as the best of NumPy ({best});")
    print(f"  verdicts equal, radii within {difference:.1e}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--cotouch", default="target/release/cotouch", help="the program")
    parser.add_argument("--size", type=int, default=200, help="points in each direction")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--quick", action="store_true", help="without NumPy point by point")
    parser.add_argument("--case", choices=CASES, action="append", help="default: all")
    arguments = parser.parse_args()
    print(f"NumPy {np.__version__}, {arguments.processes} processes")
    with multiprocessing.Pool(arguments.processes) as pool:
        for name in arguments.case or CASES:
            compare(name, arguments, pool)


if __name__ == "__main__":
    main()
