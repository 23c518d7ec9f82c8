"""Two armies that detect, pursue and retreat: what each unit does is a rule of twenty lines.

    python examples/two_armies.py [--smoke] [--out two_armies.png]

Range rules, after Wieland's models of combat (Lubachevsky's article, sec. 11). The same run shows what
looking at every time step would have missed.
"""

# %% Arguments: --smoke makes a short run and a small picture, --out says where the picture goes.
import argparse
import math
import tempfile
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import carom
from carom.figures import style
from carom.io.events import read_events, read_initial
from carom.models import LEFT, TIMER, Kind, Ranges, draw
from carom.simulation.replay import Replay

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few units, a small picture")
parser.add_argument("--out", type=Path, default=Path("two_armies.png"), help="file of the picture")
args = parser.parse_args()
SIZE = 12 if args.smoke else 100  # units of each army
TIMES = (0.0, 4.0, 6.0, 8.0) if args.smoke else (0.0, 12.0, 24.0, 48.0)
EDGE = 16.0 if args.smoke else 48.0

# %% Four kinds: red and blue, and the same in retreat. Each has a circle of fire and a circle of sight.
FIRE, SIGHT = 0, 1
RADII = (1.0, 4.0)
KINDS = [Kind(name, RADII, timer=0.0, memory=[3.0]) for name in ("red", "blue", "red back", "blue back")]


def head(unit, x, y, speed):
    """Go into a direction."""
    size = math.sqrt(x * x + y * y)
    if size > 0.0:
        unit.velocity[0], unit.velocity[1] = speed * x / size, speed * y / size


def orders(unit, event):
    """Who sees foes goes for them; who sees too many goes home; who is under fire grows weaker."""
    side = unit.kind % 2
    forward = 1.0 - 2.0 * side
    foes = unit.counts[SIGHT, 1 - side] + unit.counts[SIGHT, 3 - side]
    friends = unit.counts[SIGHT, side] + 1
    if event.cause == TIMER:
        unit.timer = 0.5
        under_fire = unit.counts[FIRE, 1 - side] + unit.counts[FIRE, 3 - side]
        if under_fire > 0 and draw(unit) < 0.3:
            unit.memory[0] -= 1.0
        if unit.memory[0] <= 0.0:
            unit.removed = True
            return
    if foes > 1.5 * friends:
        unit.kind = side + 2
        unit.target = -1
        head(unit, -forward, 0.4 * draw(unit) - 0.2, 1.2)
    elif foes == 0 and event.cause == TIMER:  # not at once: whoever turned round at each LEFT would dither
        unit.kind = side
        unit.target = -1
        head(unit, forward, draw(unit) - 0.5, 0.8)
    elif unit.kind < 2 and event.cause != LEFT and event.other >= 0 and event.kind % 2 != side:
        unit.target = event.other
        head(unit, event.toward[0], event.toward[1], 1.0)


# %% Red comes from the left, blue from the right; walls keep them on the field.
rng = np.random.default_rng(4)
places = rng.uniform(0.05, 0.95, (2 * SIZE, 2)) * EDGE
places[:SIZE, 0] *= 0.35
places[SIZE:, 0] = EDGE - 0.35 * places[SIZE:, 0]
species = np.repeat([0, 1], SIZE)
velocities = np.column_stack([0.8 * (1.0 - 2.0 * species), np.zeros(2 * SIZE)])
armies = Ranges(KINDS, orders, seed=1)
field = carom.Scene(
    places,
    EDGE,
    diameter=0.2,
    velocities=velocities,
    species=species,
    species_names=("red", "blue"),
    walls=True,
    interaction=armies,
)
folder = tempfile.TemporaryDirectory()
log = Path(folder.name) / "battle.h5"
sim = carom.Simulation(field, event_log=log)
shown, strengths = [], []
steps = np.arange(0.0, TIMES[-1] + 0.5, 1.0)
for time in steps:
    sim.run(time=time - sim.time)
    units = sim.interaction
    strengths.append([(units.present & (units.kinds % 2 == side)).sum() for side in (0, 1)])
    if time in TIMES:
        shown.append((time, sim.frame().positions, units))
sim.close()
print(f"{sim.collisions} crossings, rules asked {sim.interaction.asked}")
print(f"left: red {strengths[-1][0]}, blue {strengths[-1][1]}")

# %% The log is the whole battle: asked again, the rules decide the same.
again = Replay(log, interaction=armies)
again.advance_to(sim.time)
print("a replay agrees to the bit:", bool((again.frame().positions == sim.frame().positions).all()))

# %% How long was who in whose circle? Whoever looks every dt sees a visit if a look falls into it.
events = read_events(log)
when = events.epoch * read_initial(log)["epoch_length"] + events.time
start = {}
r = places[:, None] - places[None]
apart = np.hypot(r[..., 0], r[..., 1])
level = defaultdict(int)
for i, j in zip(*np.nonzero(np.triu(apart < RADII[1], 1)), strict=True):
    level[int(i), int(j)] = 1 + int(apart[i, j] < RADII[0])
visits = {0: [], 1: []}
columns = (when, events.i, events.j, events.kind)
for time, i, j, kind in zip(*(column.tolist() for column in columns), strict=True):
    if j >= field.n:
        continue
    pair = (i, j)
    circle = 1 - (level[pair] if kind == 1 else level[pair] - 1)
    level[pair] += 1 if kind == 1 else -1
    if kind == 1:
        start[pair, circle] = time
    elif time > start.get((pair, circle), math.inf):  # some turn round at once: those are no visits
        visits[circle].append((start.pop((pair, circle)), time))
print("   dt   missed of fire  late by   missed of sight  late by")
looks = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0])
missed, late = np.zeros((2, len(looks))), np.zeros((2, len(looks)))
for k, dt in enumerate(looks):
    for circle in (FIRE, SIGHT):
        came, went = np.array(visits[circle] or [(0.0, 0.0)]).T
        look = np.ceil(came / dt) * dt
        missed[circle, k] = np.mean(look >= went)
        late[circle, k] = np.mean((look - came)[look < went]) if (look < went).any() else dt
    print(f"{dt:5.2f}  {missed[0, k]:12.4f} {late[0, k]:10.3f} {missed[1, k]:14.4f} {late[1, k]:10.3f}")

# %% The picture.
style.use()  # colors
figure, axes = plt.subplots(2, 3, figsize=(9.5, 6.2))
for ax, (time, x, units) in zip(axes.flat, shown, strict=False):
    for kind, (color, marker) in enumerate([("C3", "o"), ("C0", "o"), ("C3", "<"), ("C0", ">")]):
        who = units.present & (units.kinds == kind)
        mfc = color if kind < 2 else "none"
        ax.plot(*x[who].T, marker, color=color, ms=3, mfc=mfc, label=KINDS[kind].name)
    ax.plot(*x[~units.present].T, "x", color="0.6", ms=3, label="removed")
    ax.set(aspect="equal", xlim=(0, EDGE), ylim=(0, EDGE), xticks=[], yticks=[], title=f"t = {time:g}")
left, right = axes[1, 1:]
for side, color in enumerate(("C3", "C0")):
    left.plot(steps, np.array(strengths)[:, side], color=color)
left.set(xlabel="time", title="units left", ylim=(0, None))
for circle, name in ((FIRE, "fire, radius 1"), (SIGHT, "sight, radius 4")):
    right.loglog(looks, np.maximum(missed[circle], 1e-9), "o-", ms=3, label=name)
right.set(xlabel="time step", title="visits never seen", ylim=(1e-4, 1))
right.legend(fontsize=7)
figure.legend(
    *axes[0, 0].get_legend_handles_labels(), ncols=5, loc="lower center", frameon=False, markerscale=2
)
figure.tight_layout(rect=(0.0, 0.05, 1.0, 1.0))
figure.savefig(args.out, dpi=50 if args.smoke else 80, format="png")
folder.cleanup()
