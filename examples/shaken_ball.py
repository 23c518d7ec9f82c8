"""A ball on a shaken floor: its period doubles on the way to chaos, as in the exact map.

python examples/shaken_ball.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.io.events import read_events, read_initial
from carom.models import Gravity, Loss, Plane, Sine

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few amplitudes and bounces")
parser.add_argument("--out", type=Path, default=Path("shaken-ball"), help="folder of the picture")
args = parser.parse_args()
count, bounces, kept = (4, 60, 20) if args.smoke else (240, 400, 60)
period, restitution = 2.0 * math.pi, 0.8
args.out.mkdir(parents=True, exist_ok=True)


# %% In a field of 1, on a floor that moves as A sin t, a ball can fly for just one period: it then leaves at
# pi, where the floor moves at pi (1 - e) / (1 + e). It starts there, a little off.
def start(amplitude):
    angle = math.acos(math.pi * (1.0 - restitution) / (1.0 + restitution) / amplitude)
    return angle, 10.5 + amplitude * math.sin(angle), 1.001 * math.pi


# %% Its impacts: an event log holds their times.
def impacts(amplitude):
    angle, height, speed = start(amplitude)
    path, loss = Sine(amplitude, period, angle / period), Loss(restitution, contact_time=2e-2)
    floor = Plane((1.0,), 10.0, "floor", shake=path, impact=loss)
    scene = carom.Scene(
        [[height]], 1000.0, velocities=[[speed]], walls=True, motion=Gravity((-1.0,)), obstacles=[floor]
    )
    log = args.out / "log.h5"
    with carom.Simulation(scene, event_log=log) as sim:
        sim.run(time=bounces * period)
    found, length = read_events(log), read_initial(log)["epoch_length"]
    log.unlink()
    return found.epoch * length + found.time


# %% The exact map, without Carom: from one impact to the next, by small steps and halving.
def exact(amplitude, number):
    (angle, h, v), t, times = start(amplitude), 0.0, []
    while len(times) < number:

        def gap(s, h=h, v=v, t=t):
            return h + (v - 0.5 * s) * s - 10.5 - amplitude * math.sin(angle + t + s)

        s = 1e-2
        while gap(s) > 0.0:
            s += 1e-2
        low, high = s - 1e-2, s
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
        h, v, t = h + (v - 0.5 * high) * high, v - high, t + high
        floor = amplitude * math.cos(angle + t)
        v = floor + restitution * (floor - v)
        times.append(t)
    return np.array(times)


# %% The same impacts: where the ball is periodic, errors die out.
for strength in (1.0, 1.1):
    times = impacts(strength)[:40]
    off = np.abs(times - exact(strength, len(times))).max()
    print(f"acceleration {strength} g: {len(times)} impacts, times differ by at most {off:.1e}")

# %% The attractor, for one acceleration after the other: the phase of the floor at each impact. The line is
# where the map of the orbit of one period has the eigenvalue -1 (Tufillaro et al., 1992).
e = restitution
doubling = math.hypot(math.pi * (1.0 - e) / (1.0 + e), 2.0 * (1.0 + e * e) / (1.0 + e) ** 2)
style.use()  # colors
figure = Figure(figsize=(6.4, 4.2), layout="constrained")
axes = figure.subplots()
for strength in np.linspace(0.95, 1.25, count):
    angle, _, _ = start(strength)
    phases = np.mod((impacts(strength)[-kept:] + angle) / period, 1.0)
    axes.plot(np.full(len(phases), strength), phases, ".", color="C0", ms=1.0)
axes.axvline(doubling, color="0.6", lw=0.8)
axes.set_xlabel("largest acceleration of the floor / g")
axes.set_ylabel("phase of the floor at impact / period")
axes.set_title(f"a ball of restitution {restitution} on a shaken floor", fontsize=10)
figure.savefig(args.out / "shaken_ball.png", dpi=110)
print(f"the period doubles at {doubling:.4f} g")
print(args.out / "shaken_ball.png")
