"""A network with weights of both signs, trained in NumPy, comes onto a chip whose cells have none, and learns on there.

    python examples/python/deploy.py

As differential pairs, and as the arrays of two populations under Dale's law; few levels and few converter bits cost accuracy, and
training in place, by direct feedback alignment and by error diffusion, wins some of it back.
"""

import numpy as np

import dalean

CLASSES, HIDDEN = 10, 48


def patterns(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Ten grey patterns of 8 x 8, half of each example noise."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(CLASSES, size=count)
    return 0.5 * np.random.default_rng(0).random((CLASSES, 64))[labels] + 0.5 * rng.random((count, 64)), labels


def trained(x: np.ndarray, labels: np.ndarray, steps: int = 600) -> list[tuple[np.ndarray, np.ndarray]]:
    """Softmax regression behind a layer of ReLU, by gradient descent in floats."""
    rng = np.random.default_rng(1)
    w1, w2 = rng.normal(0, 0.15, (64, HIDDEN)), rng.normal(0, 0.15, (HIDDEN, CLASSES))
    b1, b2 = np.zeros(HIDDEN), np.zeros(CLASSES)
    for _ in range(steps):
        some = rng.integers(len(x), size=64)
        h = np.maximum(x[some] @ w1 + b1, 0)
        y = np.exp(h @ w2 + b2)
        error = y / y.sum(1, keepdims=True) - np.eye(CLASSES)[labels[some]]
        back = (error @ w2.T) * (h > 0)
        for array, step in ((w1, x[some].T @ back), (b1, back.sum(0)), (w2, h.T @ error), (b2, error.sum(0))):
            array -= 0.1 / 64 * step
    return [(w1, b1), (w2, b2)]


def accuracy(net: dalean.Network, x: np.ndarray, labels: np.ndarray) -> float:
    net.read(x, learn=False)
    return float(np.mean(net.accumulators().argmax(1) == labels))


def main(hw: dict | None = None, epochs: int = 3) -> dict[str, list[float]]:
    (x, labels), (test, answers) = patterns(2000, 1), patterns(1000, 2)
    layers = trained(x, labels)
    sums = np.maximum(test @ layers[0][0] + layers[0][1], 0) @ layers[1][0] + layers[1][1]
    told = {"float": [float(np.mean(sums.argmax(1) == answers))]}
    chip = dalean.Chip("ideal", hw or {"hw.cell.level_bits": 4, "hw.adc.bits": 5})
    for to in ("pairs", "dual"):
        net = dalean.deploy(layers, x, chip, to=to, updates=epochs * 100, overrides={"learning.batch": 20, "learning.rate": 2.0})
        told[to] = [accuracy(net, test, answers)]
        for at in range(epochs * 100):
            some = slice(at % 100 * 20, at % 100 * 20 + 20)
            seen = net.read(x[some]).astype(int)
            net.deliver(net.error_words(255 * np.eye(CLASSES, dtype=int)[labels[some]] - seen))
            net.write()
        told[to].append(accuracy(net, test, answers))
    return told


if __name__ == "__main__":
    for name, rates in main().items():
        print(f"{name:6}", *(f"{100 * rate:5.1f} %" for rate in rates), "deployed, then trained on" if len(rates) > 1 else "")
