#!/usr/bin/env python3
"""The pictures of docs/VERDICTS.md, drawn from runs and closed forms: python3 docs/verdict_figures.py [BINARY]

Needs Python 3.9 or newer and nothing else; BINARY is target/release/cotouch unless it is given.
"""

import cmath
import csv
import math
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
BINARY = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "..", "target", "release", "cotouch")
INK, GREY, BLUE, GREEN, AMBER, RED = "#1D1F21", "#94A3B8", "#1F5FBF", "#15803D", "#B45309", "#B91C1C"


class Picture:
    """An SVG document whose user units are pixels."""

    def __init__(self, width, height):
        self.size, self.parts = (width, height), []

    def line(self, points, colour=INK, width=1.5, dash=None, fill="none"):
        path = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(f'<polyline points="{path}" fill="{fill}" stroke="{colour}" stroke-width="{width}"{dashes}/>')

    def circle(self, x, y, r, colour=INK, fill="none", width=1.5):
        self.parts.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{r:.2f}" stroke="{colour}" fill="{fill}" stroke-width="{width}"/>')

    def rect(self, x, y, w, h, fill, colour="none", turn=0.0):
        about = f' transform="rotate({turn:.2f} {x + w / 2:.2f} {y + h / 2:.2f})"' if turn else ""
        self.parts.append(f'<rect x="{x:.2f}" y="{y:.2f}" width="{w:.2f}" height="{h:.2f}" fill="{fill}" stroke="{colour}"{about}/>')

    def text(self, x, y, words, anchor="start", size=13, colour=INK):
        self.parts.append(f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" font-size="{size}" fill="{colour}">{words}</text>')

    def arrow(self, x, y, dx, dy, colour=BLUE):
        length = math.hypot(dx, dy)
        ex, ey = dx / length, dy / length
        tip = (x + dx, y + dy)
        self.line([(x, y), tip], colour, 2)
        self.line([(tip[0] - 7 * ex + 4 * ey, tip[1] - 7 * ey - 4 * ex), tip, (tip[0] - 7 * ex - 4 * ey, tip[1] - 7 * ey + 4 * ex)], colour, 2)

    def save(self, name):
        width, height = self.size
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="sans-serif">'
        with open(os.path.join(HERE, name), "w", encoding="utf-8") as file:
            file.write("\n".join([head, f'<rect width="{width}" height="{height}" fill="#FFFFFF"/>', *self.parts, "</svg>"]) + "\n")
        print("wrote", os.path.join("docs", name))


class Plot:
    """A frame with axes inside a picture."""

    def __init__(self, picture, box, x, y, labels):
        self.picture, self.box, self.x, self.y = picture, box, x, y
        left, top, width, height = box
        picture.rect(left, top, width, height, "#FFFFFF", GREY)
        picture.text(left + width / 2, top + height + 34, labels[0], "middle", 12)
        picture.text(left, top - 8, labels[1], "start", 12)

    def ticks(self, xs, ys):
        left, top, width, height = self.box
        for value in xs:
            px, _ = self.at(value, self.y[0])
            self.picture.line([(px, top + height), (px, top + height + 4)], GREY, 1)
            self.picture.text(px, top + height + 17, f"{value:g}", "middle", 11)
        for value in ys:
            _, py = self.at(self.x[0], value)
            self.picture.line([(left - 4, py), (left, py)], GREY, 1)
            self.picture.text(left - 7, py + 4, f"{value:g}", "end", 11)

    def at(self, x, y):
        left, top, width, height = self.box
        return (left + (x - self.x[0]) / (self.x[1] - self.x[0]) * width,
                top + height - (y - self.y[0]) / (self.y[1] - self.y[0]) * height)

    def curve(self, points, colour, width=1.2):
        """Of many points, those that can be seen: the lowest and the highest of each half pixel."""
        columns = {}
        for x, y in points:
            columns.setdefault(int(2 * self.at(x, y)[0]), []).append((x, y))
        low_high = lambda column: (min(column, key=lambda p: p[1]), max(column, key=lambda p: p[1]))
        points = [point for column in columns.values() for point in sorted(set(low_high(column)))]
        is_inside = lambda x, y: self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]
        self.picture.line([self.at(x, y) for x, y in points if is_inside(x, y)], colour, width)


def run(scene, duration_s, settings=(), host=1):
    """A run in virtual time: rows of one host's recording."""
    with tempfile.TemporaryDirectory() as folder:
        recording = os.path.join(folder, "run.mcap")
        chosen = [word for setting in settings for word in ("--set", setting)]
        subprocess.run([BINARY, "run", scene, "--virtual", "--headless", "--duration", str(duration_s), "--record", recording, *chosen],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        subprocess.run([BINARY, "replay", recording, "--csv", folder], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        with open(os.path.join(folder, f"host{host}.csv"), newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))


def column(rows, name):
    return [(float(row["time_s"]), float(row[name])) for row in rows]


def poles():
    """The poles of a mass on a sampled spring and damper, as the stiffness rises."""
    period_s, mass_kg, damping = 1 / 1024, 0.1, 5.0
    picture = Picture(660, 340)
    plot = Plot(picture, (60, 34, 260, 260), (0.5, 1.1), (-0.6, 0.6), ("real part", "imaginary part"))
    plot.ticks((0.6, 0.8, 1), (-0.5, 0, 0.5))
    around = [math.radians(angle) for angle in range(-36, 37)]
    picture.line([plot.at(math.cos(angle), math.sin(angle)) for angle in around], GREY)
    limit = 2 * damping / period_s
    tracks = ([], [])
    for step in range(1, 400):
        stiffness = limit * 2.2 * (step / 400) ** 2
        # The mass moves freely between ticks, under the force of the last one.
        a = 1 - stiffness * period_s**2 / (2 * mass_kg)
        b = period_s - damping * period_s**2 / (2 * mass_kg)
        c, d = -stiffness * period_s / mass_kg, 1 - damping * period_s / mass_kg
        root = cmath.sqrt((a - d) ** 2 + 4 * b * c)
        for track, pole in zip(tracks, ((a + d + root) / 2, (a + d - root) / 2)):
            track.append((abs(pole) < 1, plot.at(pole.real, pole.imag)))
    for track in tracks:
        for inside, colour in ((True, GREEN), (False, RED)):
            for x, y in (point for stable, point in track if stable == inside):
                picture.circle(x, y, 1.4, colour, colour, 0)
    for line, (words, colour) in enumerate([
        ("a mass of 0.1 kg, a sampled damper of 5 N·s/m", INK),
        ("and a sampled spring whose stiffness rises", INK),
        (f"inside the circle: stable, up to {limit:.0f} N/m", GREEN),
        ("(2·b/T: the spring's limit)", GREEN),
        ("outside: each pattern adds to the motion", RED),
    ]):
        picture.text(340, 90 + 22 * line, words, size=11, colour=colour)
    picture.save("verdict-poles.svg")


def modes():
    """A box and two fingers: four contact modes, and one more where copies differ."""
    picture = Picture(640, 150)
    for place, (left, right, words) in enumerate([(0, 0, "no contact"), (1, 0, "anna.finger1"), (0, 1, "ben.finger1"), (1, 1, "both"), (2, 0, "(anna's copy)")]):
        x = 20 + 124 * place
        picture.rect(x + 34, 50, 44, 36, "#E2E8F0", INK)
        if left == 2:
            picture.rect(x + 42, 42, 44, 36, "none", GREY)
        for touches, side in ((left, -1), (right, 1)):
            gap = 9 if touches else 22
            picture.circle(x + 56 + side * (22 + gap), 68, 9, BLUE if touches else GREY, "#FFFFFF", 2)
        picture.text(x + 56, 118, words, "middle", 12)
    picture.save("verdict-modes.svg")


def toppling():
    """A box that is squeezed between free fingers turns away."""
    picture = Picture(620, 170)
    for place, turn in enumerate((0, 12, 35)):
        x, y = 110 + 200 * place, 80
        picture.rect(x - 40, y - 22, 80, 44, "#E2E8F0", INK, turn)
        angle = math.radians(turn)
        for side in (-1, 1):
            fx, fy = x + side * 50 * math.cos(angle), y + side * 50 * math.sin(angle)
            picture.circle(fx, fy, 9, BLUE, "#FFFFFF", 2)
            picture.arrow(fx + side * 30, fy, -side * 19, 0)
    picture.text(310, 155, "forces keep their direction, the box does not: it turns away whatever the rates and delays", "middle", 12)
    picture.save("verdict-toppling.svg")


DRIFT = """
[session]
architecture = "distributed"
users = 2
[hand]
mass_kg = 0.1
[object]
mass_kg = 0.4
damping_n_s_per_m = {damping}
[coupling]
hand_object = {{ stiffness_n_per_m = 3000, damping_n_s_per_m = 20 }}
remote_hand_object = {{ stiffness_n_per_m = 400, damping_n_s_per_m = 2 }}
object_object = {{ stiffness_n_per_m = 300, damping_n_s_per_m = 10 }}
[[user]]
name = "anna"
script = [ {{ do = "relax", duration_s = 0.5 }}, {{ do = "force", force_n = [2, 0, 0], duration_s = 0.3 }} ]
[[user]]
name = "ben"
script = [ {{ do = "relax", duration_s = 0.5 }} ]
"""


def drag():
    """What is let go of drifts: slower and slower where held data damp, faster and faster where too much is compensated."""
    picture = Picture(660, 290)
    plot = Plot(picture, (60, 34, 300, 200), (0, 4), (0, 1.0), ("time, s", "speed of the object after a push, m/s"))
    plot.ticks((0, 1, 2, 3, 4), (0, 0.5, 1.0))
    with tempfile.TemporaryDirectory() as folder:
        for line, (damping, colour, words) in enumerate([
            (0, BLUE, "drag pole below 1: held data damp"),
            (-6, GREEN, "compensated: each copy damped by −6 N·s/m"),
            (-10, RED, "too much, −10: a drag pole above 1 drives"),
        ]):
            scene = os.path.join(folder, "drift.toml")
            with open(scene, "w", encoding="utf-8") as file:
                file.write(DRIFT.format(damping=damping))
            rows = run(scene, 4)
            speed = next(name for name in rows[0] if name == "body1_velocity_x_m_per_s")
            plot.curve(column(rows, speed), colour, 2)
            picture.text(376, 80 + 24 * line, words, size=11, colour=colour)
    picture.save("verdict-drag.svg")


def runs():
    """Forces of a quiet, a shaking and a diverging run."""
    picture = Picture(640, 420)
    for place, (scene, settings, name, word, colour, (least, largest)) in enumerate([
        ("grasp", (), "y", "quiet: touches and releases are over soon", GREEN, (-3, 1)),
        ("grasp-centralized", (), "y", "shaking: over 0.05 N rms above 8 Hz, for half a second or longer", AMBER, (-2.4, -1.6)),
        ("single-axis", ("coupling.remote_hand_object.stiffness_n_per_m=1500",), "x", "diverging: it grows, or a limit acts", RED, (-24, 24)),
    ]):
        plot = Plot(picture, (60, 30 + 130 * place, 560, 80), (0, 10), (least, largest), ("time, s" if place == 2 else "", f"{scene}, N: {word}"))
        plot.ticks(range(0, 11, 2) if place == 2 else (), (least, (least + largest) / 2, largest))
        rows = run(scene, 10, settings)
        force = f"finger1_commanded_force_{name}_n"
        plot.curve(column(rows, force), colour, 0.8)
    picture.save("verdict-runs.svg")


for draw in (poles, modes, toppling, drag, runs):
    draw()
