"""Sheared particles in the laboratory frame, from collision to collision: all pairs, and all their images."""

import itertools
import math

import numpy as np


class Naive:
    """Equal hard spheres under Lees and Edwards's boundary condition, advanced from collision to collision.

    The image that is k edges up along axis 1 stands ``k L_1 strain`` further along axis 0, and moves by ``k
    L_1 rate`` faster.
    """

    def __init__(self, places, peculiar, box, rate, restitution=1.0):
        self.x, self.v = np.array(places, float), np.array(peculiar, float)
        self.v[:, 0] += rate * self.x[:, 1]
        self.box, self.rate, self.restitution = np.array(box, float), rate, restitution
        self.time = self.strain = 0.0

    def shift(self, image):
        move = np.array(image) * self.box
        move[0] += image[1] * self.box[1] * self.strain
        speed = np.zeros(len(self.box))
        speed[0] = image[1] * self.box[1] * self.rate
        return move, speed

    def images(self, dx, dv, duration):
        """All images that come within a diameter along every axis."""
        spans = []
        for axis in range(1, len(self.box)):
            ends = np.array([dx[axis], dx[axis] + dv[axis] * duration])
            edge = self.box[axis]
            spans.append(range(math.ceil((-1 - ends.max()) / edge), math.floor((1 - ends.min()) / edge) + 1))
        for others in itertools.product(*spans):
            start = dx[0] + others[0] * self.box[1] * self.strain
            end = start + (dv[0] + others[0] * self.box[1] * self.rate) * duration
            low, high = min(start, end), max(start, end)
            for first in range(math.ceil((-1 - high) / self.box[0]), math.floor((1 - low) / self.box[0]) + 1):
                yield (first, *others)

    def next(self, limit):
        best = None
        for i, j in itertools.combinations(range(len(self.x)), 2):
            dx, dv = self.x[j] - self.x[i], self.v[j] - self.v[i]
            for image in self.images(dx, dv, limit if best is None else best[0]):
                move, speed = self.shift(image)
                r, w = dx + move, dv + speed
                rv, vv, gap = r @ w, w @ w, r @ r - 1.0
                root = rv * rv - vv * gap
                if rv < 0.0 <= root:
                    t = max(gap / (math.sqrt(root) - rv), 0.0)
                    if t <= limit and (best is None or (t, i, j) < best[:3]):
                        best = (t, i, j, image)
        return best

    def run(self, collisions):
        while collisions:
            found = self.next(1.0)
            t = 1.0 if found is None else found[0]
            self.x += self.v * t
            self.time += t
            self.strain += self.rate * t
            if found is not None:
                collisions -= 1
                self.collide(*found[1:])
            self.wrap()  # after the collision, whose image is that of before

    def collide(self, i, j, image):
        move, speed = self.shift(image)
        r, w = self.x[j] + move - self.x[i], self.v[j] + speed - self.v[i]
        change = 0.5 * (1.0 + self.restitution) * (r @ w) / (r @ r) * r
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
