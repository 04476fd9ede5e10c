# SPDX-License-Identifier: Apache-2.0
"""Line plots as SVG, with nothing but the standard library."""
import math
from html import escape

COLOURS = ["#c1272d", "#2166ac", "#1b7837", "#b87f00", "#762a83", "#333333"]
WIDTH, HEIGHT, LEFT, TOP = 330, 270, 62, 44


def _round_step(span):
    raw = span / 5
    decade = 10 ** math.floor(math.log10(raw))
    return next(m * decade for m in (1, 2, 5, 10) if raw <= m * decade * 1.0001)


class _Axis:
    def __init__(self, values, log, zero):
        values = [v for v in values if math.isfinite(v) and (v > 0 or not log)]
        if not values:
            raise ValueError("there is nothing to plot")
        self.log = log
        low, high = min(values), max(values)
        if log:
            self.low, self.high = math.log10(low), math.log10(high)
            if self.high - self.low < 0.1:
                self.low, self.high = self.low - 0.1, self.high + 0.1
        else:
            self.low, self.high = (min(0, low) if zero else low), high
            if not self.high > self.low:
                self.high = self.low + 1

    def at(self, value):
        return ((math.log10(value) if self.log else value) - self.low) / (self.high - self.low)

    def ticks(self):
        if self.log:
            for decade in range(math.floor(self.low), math.ceil(self.high) + 1):
                for m in (1, 2, 5) if self.high - self.low < 3 else (1,):
                    value = m * 10.0 ** decade
                    if self.low - 1e-9 <= math.log10(value) <= self.high + 1e-9:
                        yield value
            return
        step = _round_step(self.high - self.low)
        for k in range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1):
            yield k * step


class Panel:
    """One pair of axes. Curves are added with line() and points()."""

    def __init__(self, title, across, upward, log_x=False, log_y=False, zero=False):
        self.title, self.across, self.upward = title, across, upward
        self.log_x, self.log_y, self.zero = log_x, log_y, zero
        self.curves = []

    def line(self, x, y, label, dash=""):
        self.curves.append(([float(v) for v in x], [float(v) for v in y], label, dash, False))
        return self

    def points(self, x, y, label):
        self.curves.append(([float(v) for v in x], [float(v) for v in y], label, "", True))
        return self

    def svg(self, x0):
        h = _Axis([v for c in self.curves for v in c[0]], self.log_x, False)
        v = _Axis([v for c in self.curves for v in c[1]], self.log_y, self.zero)
        left, bottom = x0 + LEFT, TOP + HEIGHT
        out = [f'<text x="{left + WIDTH / 2:.1f}" y="{TOP - 16}" font-weight="bold" text-anchor="middle">{escape(self.title)}</text>']
        for t in h.ticks():
            x = left + h.at(t) * WIDTH
            out.append(f'<line x1="{x:.1f}" y1="{TOP}" x2="{x:.1f}" y2="{bottom}" stroke="#ddd"/>'
                       f'<text x="{x:.1f}" y="{bottom + 16}" text-anchor="middle">{t:.6g}</text>')
        for t in v.ticks():
            y = bottom - v.at(t) * HEIGHT
            out.append(f'<line x1="{left}" y1="{y:.1f}" x2="{left + WIDTH}" y2="{y:.1f}" stroke="#ddd"/>'
                       f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{t:.6g}</text>')
        out.append(f'<rect x="{left}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#333"/>'
                   f'<text x="{left + WIDTH / 2:.1f}" y="{bottom + 34}" text-anchor="middle">{escape(self.across)}</text>'
                   f'<text transform="translate({left - 48} {TOP + HEIGHT / 2:.1f}) rotate(-90)" text-anchor="middle">{escape(self.upward)}</text>')
        for k, (xs, ys, label, dash, dots) in enumerate(self.curves):
            colour = COLOURS[k % len(COLOURS)]
            at = [(left + h.at(x) * WIDTH, bottom - v.at(y) * HEIGHT) for x, y in zip(xs, ys)
                  if math.isfinite(x) and math.isfinite(y) and (x > 0 or not self.log_x) and (y > 0 or not self.log_y)]
            if dots:
                out += [f'<circle cx="{x:.2f}" cy="{y:.2f}" r="2.6" fill="{colour}"/>' for x, y in at]
            else:
                points = " ".join(f"{x:.2f},{y:.2f}" for x, y in at)
                out.append(f'<polyline fill="none" stroke-width="1.8" stroke="{colour}" stroke-dasharray="{dash}" points="{points}"/>')
            row_y, row_x = bottom + 54 + 16 * k, left
            out.append(f'<circle cx="{row_x + 13}" cy="{row_y}" r="2.6" fill="{colour}"/>' if dots else
                       f'<line x1="{row_x}" y1="{row_y}" x2="{row_x + 26}" y2="{row_y}" stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}"/>')
            out.append(f'<text x="{row_x + 32}" y="{row_y + 4}" font-size="11">{escape(label)}</text>')
        return "\n".join(out)


def figure(panels):
    """The panels side by side, as the text of an SVG file."""
    width = len(panels) * (WIDTH + LEFT + 28) + 10
    height = TOP + HEIGHT + 54 + 16 * max(len(p.curves) for p in panels)
    body = "\n".join(p.svg(k * (WIDTH + LEFT + 28)) for k, p in enumerate(panels))
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            f'font-family="sans-serif" font-size="12">\n<rect width="100%" height="100%" fill="#fff"/>\n{body}\n</svg>\n')
