"""A learning rule that the program does not have: sign-symmetry (Liao, Leibo and Poggio, 2016).

    python examples/python/custom_rule.py

A hidden unit hears the errors of the outputs it drives, each with the sign of its weight and not with its size. The error
words are formed here, in NumPy; what reads, takes derivatives, adds up, rounds and writes is the chip. Differential pairs, as
the rule needs weights of both signs. The receipt says what was driven and what came of it: the same on every machine.
"""

import json

import numpy as np

import dalean

HIDDEN, CLASSES, BATCH = 64, 10, 20


def patterns(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Ten patterns of 8 x 8 bits, a fifth of each example's bits drawn anew."""
    rng = np.random.default_rng(seed)
    ideal = np.random.default_rng(0).random((CLASSES, 64)) < 0.5
    labels = rng.integers(CLASSES, size=count)
    drawn = rng.random((count, 64)) < 0.2
    return np.where(drawn, rng.random((count, 64)) < 0.5, ideal[labels]).astype(float), labels


def hidden_words(net: dalean.Network, words: np.ndarray) -> np.ndarray:
    """Output words over the signs of the weights above, bounded as the chip's words are."""
    weights = net.levels(1, "e").astype(int) - net.levels(1, "i")
    sums = words.astype(int) @ np.sign(weights[:HIDDEN]).T
    return np.clip(sums, -net.word_max, net.word_max)


def main(epochs: int = 4) -> tuple[float, dict]:
    x, labels = patterns(2000, 1)
    wanted = 255 * np.eye(CLASSES, dtype=int)[labels]
    keys = {"learning.batch": BATCH}
    net = dalean.Network([64, HIDDEN, CLASSES], dalean.Chip("ideal"), rule="dfa", words="own", overrides=keys)
    for _ in range(epochs):
        for first in range(0, len(x), BATCH):
            some = slice(first, first + BATCH)
            activities = net.read(x[some])
            words = net.error_words(wanted[some] - activities.astype(int))
            net.deliver(words, layer=1)
            net.deliver(hidden_words(net, words), layer=0)
            net.write()
    test, answers = patterns(1000, 2)
    accuracy = float(np.mean(net.read(test, learn=False).argmax(axis=1) == answers))
    return accuracy, net.receipt(rule="sign-symmetry", script=__file__)


if __name__ == "__main__":
    accuracy, receipt = main()
    print(f"{100 * accuracy:.1f} % of 1000 patterns")
    print(json.dumps(receipt, indent=2))
