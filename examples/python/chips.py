"""A network that was trained elsewhere, on a thousand chips of phase-change memory, a day and a year after it was loaded.

    python examples/python/chips.py                  1,000 chips: half a minute
    python examples/python/chips.py 100 0            100 chips, none of whose cells is stuck

Loads leave noise, one cell in a hundred is stuck, levels drift; with and without a factor a layer that makes up for drift. A chip is
its number: `net.on_chips(right, chip=7)` reads one of them again.
"""

import sys
from pathlib import Path

from deploy import patterns, trained

import dalean

MODEL = Path(__file__).parents[2] / "hw_models" / "own" / "pcm_drift.toml"


def main(samples: int = 1000, stuck: float = 0.01) -> dict[tuple[str, bool], dalean.Chips]:
    """Right answers, as fractions, by arrays and by whether drift is made up for."""
    (x, labels), (test, answers) = patterns(2000, 1), patterns(1000, 2)
    layers, chip = trained(x, labels), dalean.Chip(MODEL, {"device.faults.stuck_any": stuck} if stuck else {})
    right = lambda net: float((net.read(test, learn=False).argmax(1) == answers).mean())  # noqa: E731
    told = {}
    for to in ("pairs", "dual"):
        net = dalean.deploy(layers, x, chip, to=to)
        for compensate in (False, True):
            told[to, compensate] = net.on_chips(right, samples=samples, after=["20s", "1d", "1y"], compensate=compensate)
    return told


if __name__ == "__main__":
    given = [kind(word) for kind, word in zip((int, float), sys.argv[1:])]
    for (to, compensate), chips in main(*given).items():
        for one in chips.summary:
            percent = [f"{100 * value:.1f}" for value in (one["mean"], one["quantiles"]["0.05"], one["quantiles"]["0.95"], one["least"])]
            factor = "made up for" if compensate else "as it is"
            print(f"{to:6} {factor:12} {one['after_s']:>12.0f} s: mean %s, 5 %% and 95 %% of the chips %s and %s, worst %s" % tuple(percent), one["worst_chip"])
