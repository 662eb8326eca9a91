#!/usr/bin/env python3
"""Soft beams: cotouch beside MuJoCo's flex and PyBullet's soft bodies, in turns, on the same machine, one core each.

All simulate the same tetrahedra: a beam of 0.4 × 0.1 × 0.1 m, clamped at one end, that swings and comes to rest under its
weight (Young's modulus 1 MPa, Poisson's ratio 0.3, 1000 kg/m³). What is measured is the time for 1/60 s of simulation.

The reference of the tip's sag is the static equilibrium of the very same tetrahedra (Newton's method to 1e-13 of the beam's
length). Times are of the processor, in the mean over the periods: other programs disturb them less than a clock. Explicit forces are unstable at long steps: every peer takes the fewest substeps per 1/60 s (1, 2, 4 ...) with which
its beam comes to rest at all, and it is said how far its sag is from the reference. MuJoCo's flex is the linear material of
Saint Venant and Kirchhoff, PyBullet's is Neo-Hookean, cotouch's is corotational: at these strains they differ by a percent or
so. PyBullet damps by its own rule, and its tip hangs where its solver leaves it.

    python3 -m venv .venv && .venv/bin/pip install mujoco pybullet
    cargo build --release -p cotouch-soft --example step_times
    .venv/bin/python bench/soft_peers.py
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import tempfile
import time

SIZE_M = (0.4, 0.1, 0.1)
YOUNG_PA, POISSON, DENSITY = 1e6, 0.3, 1000.0
PERIOD_S = 1 / 60
BEAMS = {"1k": (10, 4, 4), "5k": (17, 7, 7), "20k": (28, 11, 11)}
PATHS = ((0, 1, True), (1, 2, True), (2, 0, True), (1, 0, False), (2, 1, False), (0, 2, False))


def beam(cells):
    """Nodes and tetrahedra: each cell cut into the six around its (0,0,0)–(1,1,1) diagonal."""
    nx, ny, nz = cells

    def index(corner):
        return (corner[0] * (ny + 1) + corner[1]) * (nz + 1) + corner[2]

    def places(nx, ny, nz):
        return [(x, y, z) for x in range(nx) for y in range(ny) for z in range(nz)]

    nodes = [
        tuple(SIZE_M[axis] * place[axis] / cells[axis] for axis in range(3))
        for place in places(nx + 1, ny + 1, nz + 1)
    ]
    tetrahedra = []
    for cell in places(nx, ny, nz):
        for first, second, even in PATHS:
            corner, path = list(cell), [index(cell)]
            for axis in (first, second, 3 - first - second):
                corner[axis] += 1
                path.append(index(corner))
            a, b, c, d = path
            tetrahedra.append((a, b, c, d) if even else (a, c, b, d))
    return nodes, tetrahedra, index((nx, 0, 0))


def timed_periods(step, seconds, most_periods):
    """Milliseconds of processor time a period, and how many there were: fewer where they take long."""
    periods, begin = 0, time.process_time()
    while periods < most_periods and (periods < 30 or time.process_time() - begin < seconds):
        step()
        periods += 1
    return 1e3 * (time.process_time() - begin) / periods, periods


class MuJoCo:
    name = "MuJoCo flex"

    def __init__(self, cells, substeps):
        import mujoco

        self.mujoco, self.substeps = mujoco, substeps
        nodes, tetrahedra, self.tip = beam(cells)
        mass = DENSITY * math.prod(SIZE_M)
        numbers = lambda rows: " ".join(f"{value:.9g}" for row in rows for value in row)
        pinned = " ".join(str(i) for i, node in enumerate(nodes) if node[0] == 0.0)
        # Up to version 3 this integrator takes the flex's stiffness implicitly, from version 4 on the other one does.
        integrator = "implicitfast" if int(mujoco.__version__.split(".")[0]) < 4 else "discrete"
        step = f'timestep="{PERIOD_S / substeps!r}" integrator="{integrator}"'
        model = f"""<mujoco><option {step} gravity="0 0 -9.81"/>
          <size memory="2G"/><worldbody>
          <flexcomp name="beam" type="direct" dim="3" mass="{mass!r}" radius="0.0005" point="{numbers(nodes)}"
            element="{numbers(tetrahedra)}"><contact selfcollide="none" contype="0" conaffinity="0"/>
            <elasticity young="{YOUNG_PA}" poisson="{POISSON}" damping="0.005"/><pin id="{pinned}"/>
          </flexcomp></worldbody></mujoco>"""
        self.model = mujoco.MjModel.from_xml_string(model)
        self.data = mujoco.MjData(self.model)

    def step(self):
        for _ in range(self.substeps):
            self.mujoco.mj_step(self.model, self.data)

    def sag_m(self):
        sag = -float(self.data.flexvert_xpos[self.tip][2])
        reset = any(self.data.warning[i].number for i in range(len(self.data.warning)))
        return math.nan if reset else sag


class PyBullet:
    name = "PyBullet soft body"

    def __init__(self, cells, substeps):
        import pybullet

        self.bullet, self.substeps = pybullet, substeps
        nodes, tetrahedra, tip = beam(cells)
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD, physicsClientId=self.client)
        pybullet.setGravity(0, 0, -9.81, physicsClientId=self.client)
        pybullet.setTimeStep(PERIOD_S / substeps, physicsClientId=self.client)
        with tempfile.NamedTemporaryFile("w", suffix=".vtk", delete=False) as file:
            file.write("# vtk DataFile Version 2.0\nbeam\nASCII\nDATASET UNSTRUCTURED_GRID\n")
            file.write(f"POINTS {len(nodes)} double\n")
            file.writelines("{} {} {}\n".format(*node) for node in nodes)
            file.write(f"CELLS {len(tetrahedra)} {5 * len(tetrahedra)}\n")
            file.writelines("4 {} {} {} {}\n".format(*corners) for corners in tetrahedra)
            file.write(f"CELL_TYPES {len(tetrahedra)}\n" + "10\n" * len(tetrahedra))
        mu = YOUNG_PA / (2 * (1 + POISSON))
        first_lame = YOUNG_PA * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        self.body = pybullet.loadSoftBody(
            file.name,
            simFileName=file.name,
            mass=DENSITY * math.prod(SIZE_M),
            useNeoHookean=1,
            NeoHookeanMu=mu,
            NeoHookeanLambda=first_lame,
            NeoHookeanDamping=0.01,
            collisionMargin=0.0005,
            physicsClientId=self.client,
        )
        os.unlink(file.name)
        places = self.places()
        for i, place in enumerate(places):
            if abs(place[0]) < 1e-6:
                pybullet.createSoftBodyAnchor(self.body, i, -1, -1, physicsClientId=self.client)
        corner = nodes[tip]
        self.tip = min(range(len(places)), key=lambda i: math.dist(places[i], corner))

    def places(self):
        flags = self.bullet.MESH_DATA_SIMULATION_MESH
        return self.bullet.getMeshData(self.body, -1, flags=flags, physicsClientId=self.client)[1]

    def step(self):
        for _ in range(self.substeps):
            self.bullet.stepSimulation(physicsClientId=self.client)

    def sag_m(self):
        return -self.places()[self.tip][2]


def settles(peer, reference_m):
    """Whether a second goes by without the beam leaving all bounds."""
    for _ in range(60):
        peer.step()
        if not abs(peer.sag_m()) < 3 * reference_m:
            return False
    return True


def measure_peer(kind, cells, reference_m, seconds):
    for substeps in (1, 2, 4, 8, 16, 32, 64):
        begin = time.process_time()
        if settles(kind(cells, substeps), reference_m):
            peer = kind(cells, substeps)
            mean_ms, periods = timed_periods(peer.step, seconds, 240)
            return {"substeps": substeps, "mean_ms": mean_ms, "sag_m": peer.sag_m(), "periods": periods}
        if time.process_time() - begin > 4 * seconds:
            break
    return None


def measure_cotouch(program, cells, periods):
    done = subprocess.run([program, str(periods), ",".join(map(str, cells))], capture_output=True, check=True)
    return json.loads(done.stdout)[0]


def compare(name, cells, arguments):
    found = measure_cotouch(arguments.cotouch, cells, 240)
    reference = found["static_sag_m"]
    print(f"{name}: {found['tetrahedra']} tetrahedra, {found['nodes']} nodes; sag at rest {1e3 * reference:.3f} mm")
    means, peers = [], {}
    for kind in (None, MuJoCo, PyBullet):
        if kind:
            peers[kind] = measure_peer(kind, cells, reference, arguments.seconds)
        means.append(measure_cotouch(arguments.cotouch, cells, 240)["processor_mean_ms"])
    ours = statistics.median(means)
    off = 100 * (found["sag_m"] / reference - 1)
    print(f"  {'cotouch':20} {ours:9.3f} ms   sag {off:+.2f} % after 4 s, {found['bytes_per_tetrahedron']} bytes a tetrahedron")
    for kind, row in peers.items():
        if row is None:
            print(f"  {kind.name:20} did not come to rest with any number of substeps that was tried")
            continue
        mean_ms = row["mean_ms"]
        off = 100 * (row["sag_m"] / reference - 1)
        print(
            f"  {kind.name:20} {mean_ms:9.3f} ms   sag {off:+.2f} % after {row['periods'] * PERIOD_S:.1f} s, "
            f"{row['substeps']} substeps; cotouch is {mean_ms / ours:.1f} times as fast",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--cotouch", default="target/release/examples/step_times", help="the example program")
    parser.add_argument("--seconds", type=float, default=20.0, help="at most about so long a measurement of a peer")
    parser.add_argument("--beam", choices=BEAMS, action="append", help="default: all")
    arguments = parser.parse_args()
    for name in arguments.beam or BEAMS:
        compare(name, BEAMS[name], arguments)


if __name__ == "__main__":
    main()
