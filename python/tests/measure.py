"""What the package costs: run in an environment that has it.

    python measure.py [mnist]

With `mnist`, learning too: it takes minutes, and reads MNIST from the folder that DALEAN_DATA names.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import dalean


def seconds(call, times):
    """The median of single calls, and the processor's time of one of them on the average."""
    taken, before = [], time.process_time()
    for _ in range(times):
        started = time.perf_counter()
        call()
        taken.append(time.perf_counter() - started)
    return statistics.median(taken), (time.process_time() - before) / times


def imported():
    """The least of five: by the clock on the wall, and by the processor's."""
    now = "time.perf_counter(), time.process_time()"
    code = f"import time; a = {now}; import dalean; b = {now}; print(b[0] - a[0], b[1] - a[1])"
    run = lambda: subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    wall, processor = zip(*(map(float, run()) for _ in range(5)))
    return min(wall), min(processor)


def memory():
    code = "import resource, {}; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    of = lambda name: int(subprocess.run([sys.executable, "-c", code.format(name)], capture_output=True, text=True, check=True).stdout)
    return of("dalean") / 1024, of("numpy") / 1024


def read():
    net = dalean.Network([16, 64, 64, 4])
    x = np.random.default_rng(1).integers(256, size=(16, 16), dtype=np.uint8)
    return seconds(lambda: net.read(x, learn=False), 5000)


class Still:
    """A vector environment that takes no time."""

    def __init__(self, count):
        import gymnasium

        self.num_envs, self.metadata = count, {"autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP}
        self.single_observation_space = gymnasium.spaces.Box(-1, 1, (16,), np.float32)
        self.single_action_space = gymnasium.spaces.Discrete(4)
        rng = np.random.default_rng(1)
        self.shown = [rng.random((count, 16), dtype=np.float32) for _ in range(64)]
        self.steps, self.zeros, self.flags = 0, np.zeros(count), np.zeros(count, bool)

    def reset(self, seed=None, options=None):
        return self.shown[0], {}

    def step(self, actions):
        self.steps += 1
        return self.shown[self.steps % 64], self.zeros, self.flags, self.flags, {}


def steps():
    """Seconds of a step of one environment, learning aside: from one `step` to the next, the median."""
    env, taken, last = Still(16), [], []
    step = env.step

    def watched(actions):
        now = time.perf_counter()
        taken.extend(now - before for before in last)
        last[:] = [time.perf_counter()]
        return step(actions)

    env.step = watched
    dalean.EDPolicy(hidden=(64, 64), horizon=512).learn(env, 512 * 16 * 2)
    return statistics.median(taken) / 16


def mnist(times=3):
    """Seconds of the processor of MNIST on one thread, `EDClassifier.fit` and `dalean train` turn by turn: of two epochs, all in all, and of
    the ten that twelve take beyond two. All 60,000 examples are learnt from; the command reads files, tests and writes a folder beside."""
    place = Path(os.environ.get("DALEAN_DATA", "data")) / "mnist"
    part = lambda name, head: np.fromfile(place / f"train-{name}-ubyte", np.uint8)[head:]
    x, y = part("images-idx3", 16).reshape(-1, 784), part("labels-idx1", 8)
    program = Path(sys.executable).with_name("dalean")
    keys = {"data.set": '"mnist"', "learning.train_on": '"all"', "network.hidden": [256], "learning.batch": 32, "learning.rate": 20}

    # what MNIST has without being asked
    same = {"network.alpha": 6.0, "network.weight_max": 4.0, "learning.taps": 1, "learning.rate_multipliers": 1.0}

    def fit(epochs):
        before = time.process_time()
        dalean.EDClassifier((256,), epochs=epochs, batch=32, rate=20, overrides=same).fit(x, y)
        return time.process_time() - before

    def command(epochs):
        spent = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
        before = spent()
        with tempfile.TemporaryDirectory() as folder:
            settings = [part for key, value in {**keys, "learning.epochs": epochs}.items() for part in ("--set", f"{key}={value}")]
            subprocess.run([program, "train", "--quiet", "--threads", "1", "--out", folder, *settings], check=True, stdout=subprocess.DEVNULL)
        return spent() - before

    taken = {call: {2: [], 12: []} for call in (fit, command)}
    for _ in range(times):
        for epochs in (2, 12):
            for call, of in taken.items():
                of[epochs].append(call(epochs))
    least = {call: (min(of[2]), min(of[12]) - min(of[2])) for call, of in taken.items()}
    for call, of in taken.items():
        print(f"{call.__name__:8}", *(f"{epochs} epochs {[round(one, 2) for one in all_]} s;" for epochs, all_ in of.items()), end="")
        print(" least: two %.2f s, ten beyond %.2f s" % least[call])
    print("fit / command: two %.3f, ten beyond %.3f" % tuple(a / b for a, b in zip(least[fit], least[command])))


def main():
    if sys.argv[1:] == ["mnist"]:
        return mnist()
    print("import           %.3f s, of the processor %.3f s" % imported())
    print("memory           %.0f MB after import, of which NumPy alone %.0f MB" % memory())
    print("read             %.1f us, of the processor %.1f us: 16-64-64-4, 16 samples" % tuple(1e6 * value for value in read()))
    try:
        print(f"environment step {1e6 * steps():.2f} us: 16 environments that take no time, 64-64 units")
    except ImportError:
        print("environment step no Gymnasium")


if __name__ == "__main__":
    main()
