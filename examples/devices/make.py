"""Writes pulses.csv: reads of four cells that do not exist.

    python3 examples/devices/make.py

Made up, and no measurement of anything: steps shrink in proportion to what is left of a window of 2 to 20 microsiemens, 30 pulses
of mean length across it, upward ones a fifth longer; noise of a quarter of a step; cells differ in their steps by a tenth and in
their ceilings by a twentieth. Each cell takes 100 pulses up and 100 down, twice.
"""

import random
from pathlib import Path

random.seed(50)
lines = ["device,pulse,polarity,conductance_us"]
for device in ("A1", "A2", "B1", "B2"):
    factor, ceiling = random.gauss(1, 0.1), random.gauss(20, 0.9)
    g = 2.0
    for _ in range(2):
        for polarity in ("up", "down"):
            for pulse in range(1, 101):
                left = (ceiling - g) / (ceiling - 2) if polarity == "up" else -(g - 2) / (ceiling - 2)
                step = factor * 18 / 30 * 2 * left * (1.2 if polarity == "up" else 1.0)
                g = min(max(g + random.gauss(step, abs(step) / 4), 2.0), ceiling)
                lines.append(f"{device},{pulse},{polarity},{g:.4f}")
Path(__file__).with_name("pulses.csv").write_text("\n".join(lines) + "\n")
