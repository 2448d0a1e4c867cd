"""What the package costs: run in an environment that has it.

    python measure.py
"""

import statistics
import subprocess
import sys
import time

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


def main():
    print("import           %.3f s, of the processor %.3f s" % imported())
    print("memory           %.0f MB after import, of which NumPy alone %.0f MB" % memory())
    print("read             %.1f us, of the processor %.1f us: 16-64-64-4, 16 samples" % tuple(1e6 * value for value in read()))
    try:
        print(f"environment step {1e6 * steps():.2f} us: 16 environments that take no time, 64-64 units")
    except ImportError:
        print("environment step no Gymnasium")


if __name__ == "__main__":
    main()
