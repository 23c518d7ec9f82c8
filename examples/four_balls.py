"""The paper's algorithm on four balls, cycle by cycle, with 3 x 3 sectors and without, traced and drawn.

    python examples/four_balls.py [--smoke] [--out four_balls.png]

After Figures 5.2 and 5.3 of Lubachevsky (1991), with initial conditions of its own. Balls count from 1, too.
"""

# %% Arguments: --smoke makes fewer cycles and a small picture, --out says where the picture goes.
import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, Rectangle

from carom.reference import Billiard, Figure2

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a few cycles, a small picture")
parser.add_argument("--out", type=Path, default=Path("four_balls.png"), help="file of the picture")
args = parser.parse_args()

# %% Four balls on a square table without edges: what leaves on one side comes back on the other.
EDGE, DIAMETER = 300.0, 60.0
POSITIONS = [[193, 245], [63, 139], [253, 114], [63, 248]]
VELOCITIES = [[0.1, -0.9], [-1.0, 0.4], [0.5, 0.6], [0.4, -0.1]]


def billiard(sectors):
    """The same four balls, on a table with sectors or (None) without."""
    return Billiard(POSITIONS, VELOCITIES, [EDGE, EDGE], diameter=DIAMETER, sectors=sectors)


# %% The trace. Each ball has an old event, in the past, and a new one, scheduled: "0 > 35 (3)" says that the
# ball was last examined at time 0 and will collide with ball 3 at time 35. Without a number in parentheses it
# will cross a sector boundary, or merely advance, because its partner has found an earlier collision.
def event(scheduled):
    """One column of the trace: old time > new time (partner)."""
    new = "never" if np.isinf(scheduled.new_time) else f"{scheduled.new_time:.0f}"
    partner = "" if scheduled.partner is None else f"({scheduled.partner})"
    return f"{scheduled.old_time:.0f} > {new} {partner}".strip()


def trace(title, run, cycles):
    """Do the cycles, print one line for each, and yield the run after each."""
    print(f"\n{title}\n{'cycle':>5} {'time':>5} {'ball':>4} {'event':<12}", end="")
    print("".join(f"{f'ball {ball}':<16}" for ball in run.balls) + "scheduled")
    for _ in range(cycles):
        done = run.cycle()
        columns = "".join(f"{event(run.scheduled(ball)):<16}" for ball in run.balls)
        news = "" if done.partner is None else f"{done.ball} meets {done.partner}"
        news += "" if done.third_party is None else f", {done.third_party} is left to advance"
        print(f"{done.number:>5} {done.time:>5.0f} {done.ball:>4} {done.kind:<12}{columns}{news}".rstrip())
        run.check_invariants()
        yield run
    print(
        f"{len(run.collisions)} collisions, {run.crossings} crossings of sector boundaries, "
        f"{run.advancements} advancements."
    )


# %% The picture of one cycle: a full disk where a ball is now, its velocity (an arrow), and a dashed circle
# where its new event takes place, with "(partner) time". A dotted circle is where the old event was. Gray
# disks are periodic images.
COLORS = ["#0072b2", "#d55e00", "#009e73", "#aa4499"]
ARROW, MARGIN = 45.0, 75.0


def draw_ball(axes, run, ball, color):
    """Old event, present state and new event of one ball."""
    radius, s = DIAMETER / 2, run.scheduled(ball)
    # Onto the table by the present position; the new position goes along with it, even if that is outside.
    now = s.old_position + s.old_velocity * (run.current_time - s.old_time)
    shift = -EDGE * np.floor(now / EDGE)
    now = now + shift
    for offset in np.array([(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]) * EDGE:
        image = now + offset
        axes.add_patch(Circle(image, radius, facecolor="0.93", edgecolor="0.75", zorder=1))
        axes.text(*image, f"{ball}", color="0.6", ha="center", va="center", clip_on=True)
    if run.current_time > s.old_time:
        axes.add_patch(Circle(s.old_position + shift, radius, fill=False, ls=":", color=color, zorder=2))
    axes.add_patch(Circle(now, radius, facecolor=color, alpha=0.35, edgecolor=color, lw=1.5, zorder=3))
    axes.annotate(
        "",
        now + ARROW * s.old_velocity,
        now,
        arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2.2, "shrinkA": 0, "shrinkB": 0},
        zorder=5,
    )
    behind = now - [0.5 * radius * np.sign(s.old_velocity[0] or 1.0), 0]
    number = {"fontsize": 14, "weight": "bold", "ha": "center", "va": "center", "zorder": 6}
    axes.text(*behind, f"{ball}", **number)
    label = {"ha": "center", "va": "center", "fontsize": 10.5, "color": color, "weight": "bold", "zorder": 7}
    label["bbox"] = {
        "boxstyle": "round,pad=0.15",
        "facecolor": "white",
        "edgecolor": color,
        "lw": 0.6,
        "alpha": 0.9,
    }
    if s.new_position is None:
        axes.text(*(now - [0, radius + 12]), "never", **label)
        return
    after = s.new_position + shift
    partner = "" if s.partner is None else f"({s.partner}) "
    if s.new_time > run.current_time:
        axes.plot(*zip(now, after, strict=True), ls="--", lw=1.0, color=color, zorder=4)
        axes.add_patch(Circle(after, radius, fill=False, ls="--", lw=1.5, color=color, zorder=4))
        forward = (after - now) / np.linalg.norm(after - now)
        axes.text(*(after + 0.55 * radius * forward), f"{partner}{s.new_time:.0f}", **label)
    else:
        axes.text(*(now - [0, radius + 12]), f"{partner}{s.new_time:.0f}", **label)


def draw(axes, run, sectors):
    """One frame: the table, its sectors and the balls."""
    axes.add_patch(Rectangle((0, 0), EDGE, EDGE, fill=False, lw=2.0, zorder=2))
    for line in [] if sectors is None else np.linspace(0, EDGE, sectors[0] + 1)[1:-1]:
        axes.plot([line, line], [0, EDGE], color="0.5", lw=0.8, zorder=0)
        axes.plot([0, EDGE], [line, line], color="0.5", lw=0.8, zorder=0)
    for ball, color in zip(run.balls, COLORS, strict=True):
        draw_ball(axes, run, ball, color)
    axes.set(
        xlim=(-MARGIN, EDGE + MARGIN), ylim=(-MARGIN, EDGE + MARGIN), aspect="equal", xticks=[], yticks=[]
    )
    axes.set_title(f"after cycle {run.cycles}, time {run.current_time:.0f}", fontsize=12)


# %% Both runs. Without sectors balls look further ahead: more of what they plan is overruled by an earlier
# collision.
ROWS = [
    ("With 3 x 3 sectors", [3, 3], (2, 4, 6)),
    ("Without sectors", None, (4, 5, 6)),
]
cycles = 8 if args.smoke else 30
figure, grid = plt.subplots(2, 3, figsize=(15, 10.6), dpi=40 if args.smoke else 110, layout="constrained")
for row, (title, sectors, shown) in zip(grid, ROWS, strict=True):
    frames = iter(row)
    for run in trace(title, Figure2(billiard(sectors)), cycles):
        if run.cycles in shown:
            draw(next(frames), run, sectors)
    row[0].set_ylabel(title, fontsize=14, weight="bold")
figure.suptitle(
    "Disk: now. Arrow: velocity. Dotted: old event. Dashed: new event, (partner) time. Gray: images.",
    fontsize=13,
)
figure.savefig(args.out)
print(f"\nThe picture is in {args.out}.")
