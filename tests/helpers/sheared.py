"""Sheared particles in the laboratory frame, from collision to collision: all pairs, and all their images."""

import itertools
import math

import numpy as np


class Naive:
    """Equal hard spheres, which may grow, under Lees and Edwards's boundary condition.

    The image that is k edges up along axis 1 stands ``k L_1 strain`` further along axis 0, and moves by ``k
    L_1 rate`` faster.
    """

    def __init__(self, places, peculiar, box, rate, restitution=1.0, growth=0.0):
        self.x, self.v = np.array(places, float), np.array(peculiar, float)
        self.v[:, 0] += rate * self.x[:, 1]
        self.box, self.rate, self.restitution = np.array(box, float), rate, restitution
        self.time = self.strain = 0.0
        self.diameter, self.growth = 1.0, growth
        self.collisions = 0

    def shift(self, image):
        move = np.array(image) * self.box
        move[0] += image[1] * self.box[1] * self.strain
        speed = np.zeros(len(self.box))
        speed[0] = image[1] * self.box[1] * self.rate
        return move, speed

    def images(self, dx, dv, duration):
        """All images that come within a diameter along every axis."""
        near = self.diameter + self.growth * duration
        spans = []
        for axis in range(1, len(self.box)):
            ends = np.array([dx[axis], dx[axis] + dv[axis] * duration])
            edge = self.box[axis]
            low, high = (-near - ends.max()) / edge, (near - ends.min()) / edge
            spans.append(range(math.ceil(low), math.floor(high) + 1))
        for others in itertools.product(*spans):
            start = dx[0] + others[0] * self.box[1] * self.strain
            end = start + (dv[0] + others[0] * self.box[1] * self.rate) * duration
            low, high = (-near - max(start, end)) / self.box[0], (near - min(start, end)) / self.box[0]
            for first in range(math.ceil(low), math.floor(high) + 1):
                yield (first, *others)

    def next(self, limit):
        best = None
        for i, j in itertools.combinations(range(len(self.x)), 2):
            dx, dv = self.x[j] - self.x[i], self.v[j] - self.v[i]
            for image in self.images(dx, dv, limit if best is None else best[0]):
                move, speed = self.shift(image)
                r, w = dx + move, dv + speed
                contact = self.diameter
                rv, vv, gap = r @ w - contact * self.growth, w @ w - self.growth**2, r @ r - contact**2
                root = rv * rv - vv * gap
                if (rv < 0.0 or vv < 0.0) and root >= 0.0:
                    t = max(gap / (math.sqrt(root) - rv), 0.0)
                    if t <= limit and (best is None or (t, i, j) < best[:3]):
                        best = (t, i, j, image)
        return best

    def run(self, collisions):
        target = self.collisions + collisions
        while self.collisions < target:
            self.step(1.0)

    def run_for(self, duration):
        while duration > 0.0:
            duration -= self.step(duration)

    def step(self, limit):
        """Go on to the next collision, or for the time limit, and return how long that took."""
        found = self.next(limit)
        t = limit if found is None else found[0]
        self.x += self.v * t
        self.time += t
        self.strain += self.rate * t
        self.diameter += self.growth * t
        if found is not None:
            self.collisions += 1
            self.collide(*found[1:])
        self.wrap()  # after the collision, whose image is that of before
        return t

    def change_rate(self, rate):
        """The rate jumps; peculiar velocities stay."""
        peculiar = self.peculiar
        self.rate = rate
        self.v = peculiar + rate * np.outer(self.x[:, 1], np.eye(len(self.box))[0])

    def collide(self, i, j, image):
        move, speed = self.shift(image)
        r, w = self.x[j] + move - self.x[i], self.v[j] + speed - self.v[i]
        approach = r @ w - math.sqrt(r @ r) * self.growth  # of the surfaces
        change = 0.5 * (1.0 + self.restitution) * approach / (r @ r) * r
        self.v[i] += change
        self.v[j] -= change

    def wrap(self):
        for x, v in zip(self.x, self.v, strict=True):
            turns = math.floor(x[1] / self.box[1])
            x[1] -= turns * self.box[1]
            x[0] -= turns * self.box[1] * self.strain
            v[0] -= turns * self.box[1] * self.rate
            x -= np.floor(x / self.box) * self.box

    @property
    def peculiar(self):
        return self.v - self.rate * np.outer(self.x[:, 1], np.eye(len(self.box))[0])


class NaiveSteps(Naive):
    """The same of pairs on steps: rising distances, and the energy inside of each.

    ``level`` holds how many of the distances a pair is beyond, of pairs that are not beyond all.
    """

    def __init__(self, places, peculiar, box, rate, distances, energies):
        super().__init__(places, peculiar, box, rate)
        self.diameter = distances[-1]
        self.distances, self.energies, self.level = distances, [*energies, 0.0], {}
        for i, j in itertools.combinations(range(len(self.x)), 2):
            near = [r @ r for _, r, _ in self.relative(i, j, 0.0)]
            if near and min(near) < distances[-1] ** 2:
                self.level[i, j] = int(np.searchsorted(distances, math.sqrt(min(near)), side="right"))

    def relative(self, i, j, duration):
        dx, dv = self.x[j] - self.x[i], self.v[j] - self.v[i]
        for image in self.images(dx, dv, duration):
            move, speed = self.shift(image)
            yield image, dx + move, dv + speed

    @property
    def energy(self):
        return 0.5 * (self.peculiar**2).sum() + sum(self.energies[k] for k in self.level.values())

    def next(self, limit):
        best = None
        for i, j in itertools.combinations(range(len(self.x)), 2):
            level = self.level.get((i, j), len(self.distances))
            near = self.relative(i, j, limit)
            if level < len(self.distances):  # it is there with one image alone
                near = [min(near, key=lambda each: each[1] @ each[1])]
            for image, r, w in near:
                for inwards in (True, False):
                    if (level == 0) if inwards else (level == len(self.distances)):
                        continue
                    gap = r @ r - self.distances[level - inwards] ** 2
                    rv, vv = r @ w, w @ w
                    root = rv * rv - vv * gap
                    if inwards and (rv >= 0.0 or root < 0.0):
                        continue
                    root = math.sqrt(max(root, 0.0))
                    t = max(gap / (root - rv) if inwards else (root - rv) / vv, 0.0)
                    if t <= limit and (best is None or (t, i, j) < best[:3]):
                        best = (t, i, j, image, inwards)
        return best

    def collide(self, i, j, image, inwards):
        move, speed = self.shift(image)
        r, w = self.x[j] + move - self.x[i], self.v[j] + speed - self.v[i]
        normal = r / math.sqrt(r @ r)
        before, level = normal @ w, self.level.get((i, j), len(self.distances))
        target = level - 1 if inwards else level + 1
        left = before**2 - 4.0 * (self.energies[target] - self.energies[level])
        after = -before
        if left >= 0.0:
            after = math.copysign(math.sqrt(left), before)
            self.level[i, j] = target
            if target == len(self.distances):
                del self.level[i, j]
        self.v[i] -= 0.5 * (after - before) * normal
        self.v[j] += 0.5 * (after - before) * normal
