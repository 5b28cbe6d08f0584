#!/usr/bin/env python3
"""The pictures of docs/filter.md, computed: run it again and the same files come out (standard library only).

A cup cools, T = room + excess exp(-t/tau). Uncertain are the excess and the time tau, both in logarithms.
"""

import math
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOM, TRUE = 20.0, (60.0, 20.0)
MEAN, SD = (math.log(50.0), math.log(12.0)), (0.25, 0.4)
# The simplex set of two parameters: three points of equal weight, mean zero, covariance one.
POINTS = [(math.sqrt(2.0) * math.cos(a), math.sqrt(2.0) * math.sin(a)) for a in (math.pi / 2, math.pi * 7 / 6, math.pi * 11 / 6)]
COLOURS = ("#c25b2e", "#2e7d5b", "#3b62a8")
NOISE = 1.5


def run(theta, t):
    return ROOM + math.exp(theta[0]) * math.exp(-t / math.exp(theta[1]))


def particles(mean, root):
    return [tuple(mean[i] + sum(root[i][k] * point[k] for k in range(2)) for i in range(2)) for point in POINTS]


def analysis(thetas, t, observed):
    """One step of the filter: the mean and the root after a reading."""
    z = [run(theta, t) for theta in thetas]
    mean_z = sum(z) / 3
    mean = [sum(theta[i] for theta in thetas) / 3 for i in range(2)]
    h = [sum(z[j] * POINTS[j][k] for j in range(3)) / 3 for k in range(2)]
    root = [[sum(thetas[j][i] * POINTS[j][k] for j in range(3)) / 3 for k in range(2)] for i in range(2)]
    s = sum(value * value for value in h) / NOISE**2
    gain = [value / NOISE**2 / (1.0 + s) for value in h]
    delta = observed - mean_z
    mean = [mean[i] + sum(root[i][k] * gain[k] for k in range(2)) * delta for i in range(2)]
    # (1 + h h^T / R)^(-1/2) = 1 - c h h^T, for one reading.
    c = (1.0 - 1.0 / math.sqrt(1.0 + s)) / sum(value * value for value in h)
    shrink = [[(k == m) - c * h[k] * h[m] for m in range(2)] for k in range(2)]
    root = [[sum(root[i][k] * shrink[k][m] for k in range(2)) for m in range(2)] for i in range(2)]
    return mean, root


class Axes:
    """A plot: a frame in pixels, ranges in numbers."""

    def __init__(self, left, top, width, height, x, y, labels, title):
        self.box, self.x, self.y = (left, top, width, height), x, y
        self.parts = [f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>']
        self.parts.append(f'<text x="{left + width / 2}" y="{top - 8}" text-anchor="middle" font-weight="bold">{title}</text>')
        self.parts.append(f'<text x="{left + width / 2}" y="{top + height + 30}" text-anchor="middle">{labels[0]}</text>')
        across, down = left - 34, top + height / 2
        self.parts.append(f'<text x="{across}" y="{down}" text-anchor="middle" transform="rotate(-90 {across} {down})">{labels[1]}</text>')
        for value in x[2]:
            self.parts.append(f'<text x="{self.at(value, y[0])[0]:.1f}" y="{top + height + 14}" text-anchor="middle">{value:g}</text>')
        for value in y[2]:
            self.parts.append(f'<text x="{left - 5}" y="{self.at(x[0], value)[1] + 4:.1f}" text-anchor="end">{value:g}</text>')

    def at(self, x, y):
        left, top, width, height = self.box
        return left + width * (x - self.x[0]) / (self.x[1] - self.x[0]), top + height * (1 - (y - self.y[0]) / (self.y[1] - self.y[0]))

    def line(self, points, colour, dash="", width=1.6):
        path = " ".join("{:.1f},{:.1f}".format(*self.at(*point)) for point in points)
        self.parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-dasharray="{dash}"/>')

    def dot(self, x, y, colour, radius=4.5):
        px, py = self.at(x, y)
        self.parts.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="{radius}" fill="{colour}"/>')

    def text(self, x, y, words):
        px, py = self.at(x, y)
        self.parts.append(f'<text x="{px:.1f}" y="{py:.1f}">{words}</text>')


def ellipse(mean, root, size=2.0):
    turns = [2 * math.pi * k / 90 for k in range(91)]
    unit = [(size * math.cos(a), size * math.sin(a)) for a in turns]
    return [tuple(math.exp(mean[i] + root[i][0] * u + root[i][1] * v) for i in range(2)) for u, v in unit]


def save(name, axes, width, height):
    body = "\n".join(part for axis in axes for part in axis.parts)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">'
    (HERE / name).write_text(f'{head}\n<rect width="{width}" height="{height}" fill="white"/>\n{body}\n</svg>\n', encoding="utf-8")


def parameter_axes(left, title):
    return Axes(left, 30, 250, 200, (20, 110, (25, 50, 75, 100)), (2, 36, (5, 15, 25, 35)), ("excess, K", "time, min"), title)


def course_axes(left, title):
    return Axes(left, 30, 300, 200, (0, 40, (0, 10, 20, 30, 40)), (15, 100, (20, 40, 60, 80, 100)), ("minutes", "degC"), title)


def main():
    root = [[SD[0], 0.0], [0.0, SD[1]]]
    thetas = particles(MEAN, root)
    times = [0.4 * k for k in range(101)]

    before, courses = parameter_axes(50, "what is uncertain: 3 points for 2 parameters"), course_axes(380, "one run of the model each")
    before.line(ellipse(MEAN, root), "#888", "4 3")
    for theta, colour in zip(thetas, COLOURS):
        before.dot(math.exp(theta[0]), math.exp(theta[1]), colour)
        courses.line([(t, run(theta, t)) for t in times], colour)
    reading = 8.0
    observed = run((math.log(TRUE[0]), math.log(TRUE[1])), reading)
    courses.dot(reading, observed, "black")
    courses.text(reading + 1.0, observed + 4.0, "a reading")
    save("forecast.svg", [before, courses], 720, 280)

    mean, after = analysis(thetas, reading, observed)
    moved, courses = parameter_axes(50, "what the reading leaves of it"), course_axes(380, "the runs of the new points")
    moved.line(ellipse(MEAN, root), "#bbb", "4 3")
    moved.line(ellipse(mean, after), "#444")
    for theta, colour in zip(particles(mean, after), COLOURS):
        moved.dot(math.exp(theta[0]), math.exp(theta[1]), colour)
        courses.line([(t, run(theta, t)) for t in times if t >= reading], colour)
    for theta, colour in zip(thetas, COLOURS):
        courses.line([(t, run(theta, t)) for t in times if t <= reading], colour, "3 3", 1.0)
    courses.dot(reading, observed, "black")
    save("analysis.svg", [moved, courses], 720, 280)

    all_of_them = parameter_axes(50, "reading after reading")
    truth = course_axes(380, "the run with the mean of each")
    mean, now = list(MEAN), root
    all_of_them.line(ellipse(mean, now), "#bbb", "4 3")
    for k, t in enumerate((4.0, 8.0, 14.0, 22.0, 32.0)):
        observed = run((math.log(TRUE[0]), math.log(TRUE[1])), t)
        mean, now = analysis(particles(mean, now), t, observed)
        shade = f"#{200 - 45 * k:02x}{200 - 45 * k:02x}{230 - 20 * k:02x}"
        all_of_them.line(ellipse(mean, now), shade)
        truth.line([(time, run(mean, time)) for time in times], shade)
        truth.dot(t, observed, "black", 3.5)
    all_of_them.dot(*TRUE, "#c25b2e", 4)
    all_of_them.text(TRUE[0] + 2, TRUE[1] - 1.5, "truth")
    save("passes.svg", [all_of_them, truth], 720, 280)


if __name__ == "__main__":
    main()
