# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks share: running programs, medians, tables."""
import json
import os
import platform
import statistics
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


class Skip(Exception):
    """A benchmark that cannot run here, and why."""


class Context:
    """Where the programs and results are."""

    def __init__(self, build, out, repeats, threads):
        self.build, self.out, self.repeats, self.threads = Path(build), Path(out), repeats, threads
        self.out.mkdir(parents=True, exist_ok=True)

    def program(self, name):
        path = self.build / name
        if not path.exists():
            raise Skip(f"{path} is not built")
        return str(path)


def run(arguments, **options):
    """Runs a program and returns what it printed; shows that if it fails."""
    done = subprocess.run([str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, arguments))}\nexit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def render(context, scene, image, *options):
    """Renders with dapple and returns its statistics."""
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        run([context.program("dapple"), "render", scene, "-o", image, "--stats", stats, *options])
        return json.loads(stats.read_text())


def median(values):
    return statistics.median(values)


def spread(values):
    """Half the range relative to the median: how far to trust it."""
    return (max(values) - min(values)) / 2 / statistics.median(values)


def machine():
    model = platform.processor() or platform.machine()
    try:
        for line in open("/proc/cpuinfo"):
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass
    return f"{model}, {os.cpu_count()} processors"


def table(header, rows):
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines)
