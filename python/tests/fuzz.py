"""Calls the door of the chip with whatever arrays there are; every answer is a value or an exception of Python.

    python fuzz.py 100000 [SEED]        in an environment that has the package
"""

import random
import sys
import time

import numpy as np

import dalean
from dalean import _dalean

KINDS = ["u1", "i1", "u2", "i2", ">i2", "i4", "u4", "i8", "u8", ">i8", "f2", "f4", "f8", ">f8", "c8", "?", "O", "S3", "U2", "M8[s]"]
SIZES = [0, 1, 2, 3, 4, 5, 7, 64, 70, 71]
NUMBERS = [0, 1, -1, 0.5, 2, 127, 128, -127, -128, 255, 256, 300, 65535, 65536, -65537, 2**31, 2**63, 1e30, -1e300]
STRANGE = [float("nan"), float("inf"), -float("inf"), None, "x", b"y", [], {}, object(), range(5), 3 + 4j, 10**40]
# what no machine holds among them
NETS = [[5, 3], [5, 7, 3], [], [0, 1], [5, -1], [2**40, 2], [70_000, 3], [65_535] * 50, "ab", [1.5, 2], None, [5, "x"], [5, 3 + 1j]]


def array(rng):
    """An array, or what is none."""
    if rng.random() < 0.1:
        return rng.choice(STRANGE)
    kind = np.dtype(rng.choice(KINDS))
    likely = [(4, 5), (1, 5), (5,), (4, 3), (4, 70), (5, 70), (70, 3), (3,)]
    shape = rng.choice(likely) if rng.random() < 0.7 else tuple(rng.choice(SIZES) for _ in range(rng.randrange(4)))
    with np.errstate(all="ignore"):
        try:
            made = np.full(shape, rng.choice(NUMBERS)).astype(kind)
            if made.size and kind.kind in "iuf" and rng.random() < 0.7:
                made = np.asarray(np.random.default_rng(rng.randrange(9)).integers(0, 3, shape)).astype(kind)
            if made.size and kind.kind == "f" and rng.random() < 0.3:
                made.flat[rng.randrange(made.size)] = rng.choice([np.nan, np.inf, -0.0, 1e-320])
        except (OverflowError, ValueError, TypeError):
            made = np.zeros(shape)
    way = rng.randrange(8)
    if way == 0 and made.ndim:
        wide = np.zeros((*made.shape[:-1], 2 * made.shape[-1] or 1), made.dtype)
        wide[..., : 2 * made.shape[-1] : 2] = made
        made = wide[..., : 2 * made.shape[-1] : 2]
    elif way == 1:
        made = made[::-1] if made.ndim else made
    elif way == 2:
        made = np.asfortranarray(made)
    elif way == 3 and made.dtype.itemsize > 1 and made.dtype.kind != "O":
        # not aligned
        room = np.zeros(made.nbytes + 1, np.uint8)
        off = room[1:].view(made.dtype).reshape(made.shape) if made.size else made
        off[...] = made
        made = off
    elif way == 4 and made.ndim:
        made = np.broadcast_to(made[:1], made.shape) if len(made) else made
    elif way == 5:
        made = made.tolist()
    elif way == 6:
        made.flags.writeable = False
    return made


FLAWS = {"device": {"faults": {"stuck_any": 0.1}, "programming": {"sigma": [0.02]}, "drift": {"start_s": 20.0, "change": -0.05, "change_spread": 0.02}}}
POLICY = '''task = "policy"
environment = { count = 2, horizon = 4, steps = 64, rollouts = 1 }
network.hidden = [5]
learning.batch = 4
ppo.passes = 1
'''


def learner(active, discrete):
    """A policy whose two environments show three numbers, or lines; calibrated, so that it is soon its turn to learn."""
    made = _dalean.PolicyLearner("fuzz", POLICY, "ideal", [], 1, "Mine-v0", 3, active, discrete, 2, 10, 1, None)
    good, begun, none = (np.ones((2, 3)) if active is None else dalean.Lines(np.array([0, 2]), np.array([1, 2]))), 0, [False, False]
    while begun < 2:
        if made.turn()[0] == "begin":
            made.begin(good)
            begun += 1
        else:
            made.take(good, [0, 0], none, none)
    return made


def shown(rng):
    """What environments show, or nearly."""
    way = rng.randrange(6)
    if way < 2:
        return np.asarray(np.random.default_rng(rng.randrange(9)).normal(size=(2, 3)))
    if way < 4:
        return dalean.Lines(np.array([0, rng.randrange(-1, 4)]), np.array([1, rng.choice([2, 2, 2, 1, 0, 3, -1, 2**40])]))
    return array(rng) if way == 4 else (array(rng), array(rng))


def flagged(rng):
    return rng.choice([np.zeros(2, bool), np.zeros(2, bool), np.array([True, False]), [0, 1], array(rng)])


def fuzz(calls, rng):
    """So many calls: how many were refused, how many done."""
    nets = [
        dalean.Network([5, 70, 3], overrides={"learning.batch": 4}),
        dalean.Network([5, 70, 3], words="own", overrides={"learning.batch": 4}),
        dalean.Network([5, 70, 3], dalean.Chip("ideal", {"tile.transposed_read": True}), rule="bp", words="own"),
        dalean.Network([5, 7, 3], dalean.Chip("ideal", FLAWS), overrides={"learning.batch": 4}),
        dalean.Network([5, 7, 3], overrides={"learning.batch": 4}, signed=True),
    ]
    whole = lambda: rng.choice([0, 1, 0, 1, 2, 3, -1, 2**40, 2**70, None, "a", 1.5])
    stream = lambda: rng.choice(["p", "n", "p", "n", "", "pp", "é", None, 3])
    pathway = lambda: rng.choice(["pp", "np", "e", "i", "", "\0", "nn", 4])
    spans = lambda: rng.choice([None, 100, "1d", ["1h", 1e9], 1, -1, float("nan"), 1e40, "x", [], [None], array(rng)])
    worth = lambda net: rng.choice([1, 0.5, float("nan"), None, "x", net.read(x).sum(), net.on_chips(len, samples=1)])
    rows = [[], [(1, None, 0.5)], [(1, 2.0, float("nan")), (2, float("nan"), 1.0)], [(-1, 0, 0)], [(1, 2)], "x", None]
    x = np.arange(20, dtype=np.uint8).reshape(4, 5)
    policies = [learner(None, True), learner(None, False), learner(2, True)]
    refused = done = 0
    for at in range(calls):
        if at % 5000 == 0:
            # those that are through with it begin anew
            policies = [learner(None, True), learner(None, False), learner(2, True)]
        net, policy = rng.choice(nets), rng.choice(policies)
        call = rng.choice(
            [
                lambda: net.read(array(rng), rng.choice([True, False, 1, "x"])),
                lambda: net.read(x),
                lambda: net.read(x),
                lambda: net.calibrate(array(rng)),
                lambda: net.error_words(array(rng)),
                lambda: net.deliver(array(rng), rng.choice([None, whole()])),
                lambda: net.deliver(np.ones((4, net.size(1)[1]), np.int16), rng.choice([None, 1])),
                lambda: net.write(rng.choice([None, 0, 30, 31, -1, [None], [1, 2], [1, 2, 3], "x", 2**80, array(rng)])),
                lambda: net.read_back(whole()),
                lambda: net.codes(whole(), stream()),
                lambda: net.slopes(whole(), stream()),
                lambda: net.gates(whole(), stream()),
                lambda: net.accumulators(stream()),
                lambda: net.levels(whole(), pathway()),
                lambda: net.load(whole(), pathway(), array(rng)),
                lambda: net.put_back(rng.choice([b"", bytes(100), net.checkpoint(), net.checkpoint()[:-1], "x"])),
                lambda: net.state_hash,
                lambda: net.on_chips(worth, samples=rng.choice([None, 1, 2, 0, whole()]), after=spans(), compensate=rng.choice([True, False, 3])),
                lambda: net.on_chips(lambda net: net.read(x).sum(), chip=rng.choice([0, 1, 2**64 - 1, -1, whole()]), after=rng.choice([None, "1d"])),
                lambda: net.leave(rng.choice([[0, 1], [2**64 - 1], [-1], "x"]), rng.choice([[], [100.0], [0], [float("inf")], "x"]), rng.choice([True, False, 2])),
                lambda: net.onto(whole(), whole()),
                lambda: net.home(),
                lambda: _dalean.seconds(rng.choice(["1d", "", "e", "1e400d", "-1s", "\0", "é", 3])),
                lambda: _dalean.chip_summaries(rng.choice(rows)),
                lambda: policy.turn(),
                lambda: policy.turn(),
                lambda: policy.begin(shown(rng)),
                lambda: policy.take(shown(rng), rng.choice([[0, 0], [1.0, 0], array(rng)]), flagged(rng), flagged(rng), rng.choice([None, shown(rng)]), rng.choice([None, flagged(rng)])),
                lambda: policy.take(shown(rng), [0, 0], [False, False], [False, False]),
                lambda: policy.learn(),
                lambda: policy.answer(shown(rng), rng.choice([0, 7, 2**63, -1])),
                lambda: dalean.deploy([array(rng), array(rng)], array(rng)),
                lambda: dalean.deploy([(np.ones((5, 3)), array(rng))], rng.choice([x, array(rng)]), to=rng.choice(["pairs", "dual", 3])),
                lambda: dalean.Network(rng.choice(NETS), rng.choice(["ideal", "no"])),
            ]
        )
        try:
            call()
            done += 1
        except Exception as error:  # whatever it is, it is an exception
            assert type(error).__name__ != "PanicException", error
            refused += 1
    return refused, done


if __name__ == "__main__":
    calls, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    started = time.monotonic()
    refused, done = fuzz(calls, random.Random(seed))
    print(f"{calls} calls in {time.monotonic() - started:.0f} s: {refused} refused, {done} done, no crash")
