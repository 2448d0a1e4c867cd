"""Floor 3: the chip itself."""

import importlib.util
import multiprocessing
import random

import numpy as np
import pytest

import dalean
from fuzz import fuzz

KEYS = {"learning.batch": 4}


def network(**options):
    return dalean.Network([5, 70, 3], overrides=KEYS, **options)


def batch(seed=1):
    rng = np.random.default_rng(seed)
    return rng.integers(256, size=(4, 5), dtype=np.uint8), 255 * np.eye(3, dtype=int)[rng.integers(3, size=4)]


def learn(net, updates=3):
    for seed in range(updates):
        x, wanted = batch(seed)
        activities = net.read(x)
        net.deliver(net.error_words(wanted - activities.astype(int)))
        net.write()
    return net.state_hash


def test_the_operations_and_their_ledger():
    net = network()
    assert net.layers == 2 and net.sizes == [5, 70, 3]
    assert net.pathways(0) == ["pp", "np", "nn", "pn"] and net.pathways(1) == ["pp", "np"]
    x, wanted = batch()
    activities = net.read(x)
    assert activities.dtype == np.uint8 and activities.shape == (4, 3)
    assert net.codes(1).tolist() == activities.tolist()
    assert net.codes(0, "n").shape == net.slopes(0, "n").shape == (4, 70)
    assert net.accumulators().dtype == np.int64
    words = net.error_words(wanted - activities.astype(int))
    assert words.dtype == np.int16 and abs(words).max() <= net.word_max == 127
    net.deliver(words)
    assert net.gates(0, "p").shape == (4, 70)
    before = net.levels(1, "pp")
    net.write(shift=0)
    assert (net.levels(1, "pp") != before).any() and net.updates == 1
    assert net.count("pulses_attempted") > 0
    assert net.cycles["training"]["elapsed"] > 0


def test_a_read_is_what_the_chip_computes():
    """By the equations of docs/MODEL.md, in NumPy."""
    net = network()
    x, _ = batch()
    net.read(x, learn=False)
    hidden = {stream: net.codes(0, stream).astype(np.int64) for stream in "pn"}
    levels = {name: net.levels(1, name).astype(np.int64) for name in net.pathways(1)}
    rows = len(hidden["p"][0])
    sums = hidden["p"] @ levels["pp"][:rows] - hidden["n"] @ levels["np"][:rows]
    assert (net.accumulators() == sums).all()


def test_floats_become_the_nearest_code():
    net = network()
    x = np.array([[0, 1, 0.5, 1 / 510, 0.499 / 255]])
    codes = np.array([[0, 255, 128, 1, 0]], dtype=np.uint8)
    first = net.read(x, learn=False)
    kinds = [x.astype(np.float32), x[0], x.tolist(), codes, codes.astype(np.int64), codes.astype(">i2"), np.asfortranarray(x)]
    for kind in kinds:
        assert (net.read(kind, learn=False) == first).all()
    strided = np.zeros((2, 10))
    strided[:, ::2] = x
    frozen = strided[:1, ::2]
    frozen.flags.writeable = False
    assert (net.read(frozen, learn=False) == first).all()
    assert (net.read(x > 0.4, learn=False) == net.read((x > 0.4) * 1.0, learn=False)).all()


def test_the_same_bits_whoever_counts():
    wanted = learn(network())
    assert learn(network(threads=2)) == wanted
    assert learn(network(kernel="scalar")) == wanted
    for method in ("fork", "spawn"):
        with multiprocessing.get_context(method).Pool(1) as pool:
            assert pool.apply(_worker, (2,)) == wanted
    assert learn(network(seed=2)) != wanted


def _worker(threads):
    return learn(network(threads=threads))


PARENT = None


def _continue(_):
    return learn(PARENT, 1)


def test_a_child_of_a_fork_goes_on_without_the_threads_of_its_parent():
    global PARENT
    PARENT = network(threads=2)
    learn(PARENT, 2)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        child = pool.apply_async(_continue, (0,)).get(timeout=60)
    assert child == learn(PARENT, 1)


def test_levels_and_states_go_in_and_out(tmp_path):
    net = network()
    learn(net)
    kept, hash_ = net.checkpoint(), net.state_hash
    other = network()
    assert other.state_hash != hash_
    other.put_back(kept)
    assert other.state_hash == hash_
    x, _ = batch()
    activities = net.read(x, learn=False)
    for name in ("levels.npz", "state.safetensors"):
        again = network()
        again.restore(net.save(tmp_path / name))
        assert (again.read(x, learn=False) == activities).all()
    again = network()
    again.restore_levels(kept)
    assert (again.read(x, learn=False) == activities).all()
    with pytest.raises(dalean.CheckpointError):
        dalean.Network([5, 71, 3], overrides=KEYS).put_back(kept)
    with pytest.raises(dalean.CheckpointError):
        net.put_back(kept[:-9])
    with pytest.raises(dalean.ChipError, match="0..=255"):
        net.load(0, "pp", np.full((5, 70), 256))


def test_a_run_is_read_by_the_chip(tmp_path, small):
    run = dalean.train(small, out=tmp_path, progress=False)
    net = dalean.Network([64, 16, 10])
    net.load_all(run.levels())
    assert net.levels(0, "pp").tolist() == run.levels()["layer0.pp"].tolist()


def test_errors_move_nothing():
    net = network()
    x, _ = batch()
    hash_ = net.state_hash
    for call, wanted in [
        (lambda: net.read(x[:, :4]), "shape"),
        (lambda: net.read(x.astype(float)), "0 to 1"),
        (lambda: net.read(np.full((1, 5), np.nan)), "NaN"),
        (lambda: net.read(np.full((1, 5), 256)), "0..=255"),
        (lambda: net.read("hello"), "uint8"),
        (lambda: net.read(x.astype(complex)), "uint8"),
        (lambda: net.read(np.zeros((0, 5))), "whole samples"),
        (lambda: net.deliver([[1, 2, 3]]), "learning on"),
        (lambda: net.write(), "nothing to write"),
        (lambda: net.codes(0), "read something first"),
        (lambda: net.levels(0, "xx"), "pp, np, nn, pn"),
        (lambda: net.levels(9, "pp"), "numbered from 0"),
        (lambda: net.read_back(1), "differential pairs"),
        (lambda: net.codes(0, "q"), '"p" and "n"'),
    ]:
        with pytest.raises(dalean.Error) as caught:
            call()
        assert wanted in str(caught.value), caught.value
        assert caught.value.where and caught.value.found and caught.value.allowed
    assert net.state_hash == hash_
    with pytest.raises(dalean.RunError, match="of memory"):
        dalean.Network([65_535] * 50)
    with pytest.raises(dalean.ArrayError, match="whole numbers"):
        dalean.Network([5, 3 + 1j])
    for keys in [{"learning.rule": "bp"}, {"network.channels": [4]}]:
        with pytest.raises(dalean.ConfigError):
            dalean.Network([5, 7, 3], "reram", overrides=keys)
    with pytest.raises(dalean.ConfigError, match="reram"):
        dalean.Chip("rerram")
    with pytest.raises(dalean.ConfigError, match="1..=12"):
        dalean.Chip("ideal", {"cell.level_bits": 13})


def test_finite_converters_are_calibrated():
    net = dalean.Network([5, 70, 3], dalean.Chip("reram"), overrides=KEYS)
    x, _ = batch()
    net.calibrate(x)
    assert any(one["phase"] == "calibration" for one in net.ledger)
    learn(net)


def test_back_propagation_by_hand_is_the_program_s_own():
    """Words of its own to each layer, from transposed reads, against the rule that does all of it."""
    chip = dalean.Chip("ideal", {"tile.transposed_read": True})
    own = dalean.Network([5, 70, 3], chip, rule="bp", words="own", overrides=KEYS)
    rule = dalean.Network([5, 70, 3], chip, rule="bp", overrides=KEYS)
    for seed in range(3):
        x, wanted = batch(seed)
        activities = own.read(x)
        assert (rule.read(x) == activities).all()
        words = own.error_words(wanted - activities.astype(int))
        rule.deliver(rule.error_words(wanted - activities.astype(int)))
        rule.write()
        own.deliver(words, layer=1)
        sums = own.read_back(1)
        shift = 8 - int(np.log2(_weight_max(own, 1)))
        below = np.clip((sums + (1 << (shift - 1) if shift else 0)) >> shift, -127, 127)
        own.deliver(below, layer=0)
        own.write()
        for name, levels in rule.all_levels().items():
            assert (own.all_levels()[name] == levels).all()


def _weight_max(net, layer):
    import re

    found = re.search(r"weight_max = (.*)", net.config).group(1)
    numbers = [float(number) for number in re.findall(r"[0-9.]+", found)]
    return numbers[min(layer, len(numbers) - 1)]


def test_the_custom_rule_learns_and_has_a_receipt(examples):
    path = examples / "custom_rule.py"
    lines = [line for line in path.read_text().splitlines() if line.strip()]
    assert len(lines) < 60
    spec = importlib.util.spec_from_file_location("custom_rule", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    accuracy, receipt = module.main(epochs=1)
    assert accuracy > 0.8
    again = module.main(epochs=1)
    assert again == (accuracy, receipt) and receipt["script"]["name"] == "custom_rule.py"


def test_no_call_crashes():
    refused, done = fuzz(1500, random.Random(7))
    assert refused > 300 and done > 50


def test_drives_with_a_sign():
    """A sum is that of numbers with their signs; where none lies below 0 the same is read and learnt as without one."""
    rng = np.random.default_rng(1)
    x = rng.integers(-255, 256, (7, 5))
    net = dalean.Network([5, 3], rule="bp", signed=True)
    net.read(x)
    assert net.signed and net.samples == 7
    levels = {name: net.levels(0, name).astype(int) for name in ("e", "i")}
    assert (net.accumulators() == x @ (levels["e"] - levels["i"])).all()
    # floats, and a sample alone
    net.read(x / 255)
    assert (net.accumulators() == x @ (levels["e"] - levels["i"])).all()
    net.read(x[2])
    assert (net.accumulators() == x[2:3] @ (levels["e"] - levels["i"])).all()
    both = [dalean.Network([5, 9, 3], overrides={"learning.batch": 7}, updates=9, signed=signed) for signed in (False, True)]
    for _ in range(9):
        y, errors = rng.random((7, 5)), rng.integers(-255, 256, (7, 3))
        for one in both:
            one.read(y)
            one.deliver(one.error_words(errors))
            one.write()
    assert all((one == two).all() for one, two in zip(both[0].all_levels().values(), both[1].all_levels().values()))
    assert both[0].key != both[1].key
    # what lies below 0 moves cells the other way: the same sum of a number and its opposite moves none
    still = dalean.Network([5, 3], rule="bp", overrides={"learning.batch": 2}, signed=True)
    before = still.all_levels()
    still.read(np.stack([y[0], -y[0]]))
    slopes, words = still.slopes(0).astype(int), still.error_words(np.full((2, 3), 90))
    still.deliver(words)
    assert (slopes[0] == slopes[1]).all() and (still.gates(0)[0] == still.gates(0)[1]).all()
    still.write()
    assert all((before[name] == array).all() for name, array in still.all_levels().items())
    for given, words in [
        (x * 2.0, "floats lie in -1 to 1"),
        (np.full((1, 5), np.nan), "hold NaN"),
        (x * 2, "whole numbers lie in -255..=255"),
        (x[:, :4], "samples, 5"),
        (["a"] * 5, "give floats from -1 to 1"),
    ]:
        with pytest.raises(dalean.ArrayError, match=words):
            net.read(given)
    deep = dalean.Network([5, 4, 3], dalean.Chip("ideal", {"tile.transposed_read": True}), rule="bp", words="own", signed=True)
    deep.read(x)
    for layer in (1, 0):
        deep.deliver(np.ones((7, deep.size(layer)[1]), np.int16), layer)
    assert deep.read_back(1).shape == (7, 4)
    with pytest.raises(dalean.ChipError, match="is not read from its columns"):
        deep.read_back(0)
