"""A ball on a shaken floor: it doubles its period on the way to chaos; beside it the exact map.

python examples/shaken_ball.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom.io.events import read_events
from carom.models.gravity import Gravity
from carom.models.losses import Loss
from carom.models.paths import Sine
from carom.models.planes import Plane
from carom.models.shaken import Shaken
from carom.models.surfaces import Surface

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few amplitudes and bounces")
parser.add_argument("--out", type=Path, default=Path("shaken-ball"), help="folder of the picture")
args = parser.parse_args()
count, bounces, kept = (4, 60, 20) if args.smoke else (150, 150, 60)
period, restitution = 2.0 * math.pi, 0.5
args.out.mkdir(parents=True, exist_ok=True)


# %% Impacts of a ball in a field of 1 on a floor that moves as A sin t: an event log holds their times.
def impacts(amplitude):
    floor = Shaken(Plane((1.0,), 10.0, "floor"), (1.0,), Sine(amplitude, period))
    surface = Surface(floor, Loss(restitution, contact_time=2e-2))
    scene = carom.Scene(
        [[11.0]], 1000.0, velocities=[[2.0]], periodic=False, motion=Gravity((-1.0,)), obstacles=[surface]
    )
    log = args.out / "log.h5"
    with carom.Simulation(scene, event_log=log) as sim:
        sim.run(time=bounces * period)
        length = sim.epoch_length
    found = read_events(log)
    log.unlink()
    return found.epoch * length + found.time


# %% The exact map, without Carom: from one impact to the next, by small steps and halving.
def exact(amplitude, number):
    h, v, t, times = 11.0, 2.0, 0.0, []
    while len(times) < number:

        def gap(s, h=h, v=v, t=t):
            return h + (v - 0.5 * s) * s - 10.5 - amplitude * math.sin(t + s)

        s = 1e-3
        while gap(s) > 0.0 or (s < 1e-2 and gap(s + 1e-3) > gap(s)):
            s += 1e-3
        low, high = s - 1e-3, s
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
        h, v, t = h + (v - 0.5 * high) * high, v - high, t + high
        floor = amplitude * math.cos(t)
        v = floor + restitution * (floor - v)
        times.append(t)
    return np.array(times)


# %% The same impacts: where the ball is periodic, errors die out. (Where it comes to rest on the floor, or is
# chaotic, the two differ after a while.)
for strength in (1.6,):
    times, wanted = impacts(strength)[:50], exact(strength, 50)
    off = np.abs(times - wanted[: len(times)]).max()
    print(f"acceleration {strength} g: {len(times)} impacts, times differ by at most {off:.1e}")

# %% The attractor, for one acceleration after the other: the phase of the floor at each impact.
strengths = np.linspace(1.3, 5.0, count)
figure = Figure(figsize=(6.4, 4.2), layout="constrained")
axes = figure.subplots()
for strength in strengths:
    phases = np.mod(impacts(strength)[-kept:] / period, 1.0)
    axes.plot(np.full(len(phases), strength), phases, ",", color="C0", alpha=0.8)
axes.set_xlabel("largest acceleration of the floor / g")
axes.set_ylabel("phase at impact / period")
axes.set_title(f"a ball of restitution {restitution} on a shaken floor", fontsize=10)
figure.savefig(args.out / "shaken_ball.png", dpi=110)
print(args.out / "shaken_ball.png")
