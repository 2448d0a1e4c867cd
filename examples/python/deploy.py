"""A network with weights of both signs, trained in NumPy, comes onto a chip whose cells have none, and learns on there.

    python examples/python/deploy.py

As differential pairs, and as the arrays of two populations under Dale's law. Few levels and few bits of converters cost accuracy;
the output layer, trained on in place, wins some of it back. Hidden layers, which other errors shaped, would lose by local ones.
"""

import numpy as np

import dalean

NOISE, KEYS = 0.72, {"learning.batch": 20, "learning.rate": 0.05, "learning.control": "frozen_hidden"}
softmax = lambda y: np.exp(y) / np.exp(y).sum(1, keepdims=True)  # noqa: E731


def patterns(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Ten grey patterns of 8 x 8, most of each example noise."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(10, size=count)
    return (1 - NOISE) * np.random.default_rng(0).random((10, 64))[labels] + NOISE * rng.random((count, 64)), labels


def trained(x: np.ndarray, labels: np.ndarray, units: int = 48) -> list[tuple[np.ndarray, np.ndarray]]:
    """A layer of ReLU and a softmax, by gradient descent in floats."""
    rng = np.random.default_rng(1)
    (w1, b1), (w2, b2) = layers = [(rng.normal(0, 0.15, (a, b)), np.zeros(b)) for a, b in ((64, units), (units, 10))]
    for _ in range(1500):
        some = rng.integers(len(x), size=64)
        h = np.maximum(x[some] @ w1 + b1, 0)
        error = softmax(h @ w2 + b2) - np.eye(10)[labels[some]]
        back = (error @ w2.T) * (h > 0)
        for array, step in ((w1, x[some].T @ back), (b1, back.sum(0)), (w2, h.T @ error), (b2, error.sum(0))):
            array -= 0.1 / 64 * step
    return layers


def main(epochs: int = 6) -> dict[str, list[float]]:
    """Accuracy in floats; deployed, and after each epoch on the chip."""
    (x, labels), (test, answers) = patterns(2000, 1), patterns(1000, 2)
    layers, chip = trained(x, labels), dalean.Chip("ideal", {"hw.cell.level_bits": 4, "hw.adc.bits": 5})
    hits = lambda y: float(np.mean(y.argmax(1) == answers))  # noqa: E731
    told = {"float": [hits(np.maximum(test @ layers[0][0] + layers[0][1], 0) @ layers[1][0] + layers[1][1])]}
    for to in ("pairs", "dual"):
        net = dalean.deploy(layers, x, chip, to=to, updates=epochs * 100, overrides=KEYS)
        for epoch in range(epochs + 1):
            net.read(test, learn=False)
            told.setdefault(to, []).append(hits(dalean.outputs(net)))
            for some in np.arange(2000).reshape(-1, 20) if epoch < epochs else ():
                net.read(x[some])
                errors = np.eye(10)[labels[some]] - softmax(dalean.outputs(net))
                net.deliver(net.error_words(np.rint(255 * errors).astype(int)))
                net.write()
    return told


if __name__ == "__main__":
    for name, rates in main().items():
        print(f"{name:6}", " -> ".join(f"{100 * rate:.1f} %" for rate in rates))
