"""Networks that were trained elsewhere, on the chip."""

import importlib.util
import json

import numpy as np
import pytest

import dalean


def layers(biased=True, sizes=(6, 9, 8, 4), seed=3):
    rng = np.random.default_rng(seed)
    pairs = [(rng.normal(0, 0.6, (a, b)), rng.normal(0, 0.2, b) if biased else None) for a, b in zip(sizes, sizes[1:])]
    return pairs, rng.random((200, sizes[0]))


def forward(pairs, x, function=lambda z: np.maximum(z, 0)):
    for at, (weights, biases) in enumerate(pairs):
        x = x @ weights + (0 if biases is None else biases)
        x = function(x) if at < len(pairs) - 1 else x
    return x


def logistic(z):
    return 1 / (1 + np.exp(-z))


def sums(net, x):
    net.read(x, learn=False)
    return net.accumulators().astype(float)


@pytest.mark.parametrize("to", ["pairs", "dual"])
@pytest.mark.parametrize("biased", [True, False])
@pytest.mark.parametrize("activation", ["relu", "sigmoid"])
def test_a_deployed_network_computes_what_it_did(to, biased, activation):
    """Catches a sign, a scale or a bias that went to the wrong place: any of them lowers the correlation below 0.9."""
    pairs, x = layers(biased)
    net = dalean.deploy(pairs, x, dalean.Chip("ideal", {"cell.level_bits": 10}), to=to, activation=activation)
    wanted = forward(pairs, x, logistic if activation == "sigmoid" else lambda z: np.maximum(z, 0))
    found = sums(net, x)
    for of in range(4):
        assert np.corrcoef(wanted[:, of], found[:, of])[0, 1] > 0.995
    assert np.mean(found.argmax(1) == wanted.argmax(1)) > 0.97
    # the units of both streams are alike, and there are no others than the weights said
    for (weights, biases), (back, shift), told in zip(pairs, dalean.signed(net), net.deployment):
        assert np.abs(back - weights).max() < 2e-3 * max(np.abs(weights).max(), 1)
        assert biased == (shift is not None) and (not biased or np.abs(shift - biases).max() < 4e-3)
        assert told.error_rms < 0.5
    if to == "dual":
        assert (net.levels(0, "pp") == net.levels(0, "nn")).all() and (net.levels(0, "pn") == net.levels(0, "np")).all()
        assert (net.codes(0, "p") == net.codes(0, "n")).all()


def test_pairs_and_both_populations_compute_the_same():
    pairs, x = layers()
    nets = [dalean.deploy(pairs, x, to=to) for to in ("pairs", "dual")]
    assert (sums(nets[0], x) == sums(nets[1], x)).all()


def test_a_window_with_a_floor_holds_the_same_differences():
    pairs, x = layers()
    chip = dalean.Chip("ideal", {"cell.level_bits": 8, "cell.floor": 40, "cell.ceiling": 200})
    net = dalean.deploy(pairs, x, chip)
    assert min(of.min() for of in net.all_levels().values()) == 40
    assert max(of.max() for of in net.all_levels().values()) <= 200
    assert np.corrcoef(forward(pairs, x).ravel(), sums(net, x).ravel())[0, 1] > 0.98


@pytest.mark.parametrize("to", ["pairs", "dual"])
@pytest.mark.parametrize("hw", ["ideal", "reram", "isaac", "prime", "ecram", "mrr", "mzi"])
def test_chips_of_all_kinds_take_it_as_it_is(hw, to):
    """Electronic and photonic, of 2 to 10 bits, converters as they have them. Answers by chance agree in a quarter of the cases."""
    pairs, x = layers(sizes=(20, 30, 4))
    wanted = forward(pairs, x).argmax(1)
    net = dalean.deploy(pairs, x, hw, to=to)
    net.read(x, learn=False)
    assert np.mean(dalean.outputs(net).argmax(1) == wanted) > (0.6 if net.level_bits < 4 else 0.85)


def test_where_a_network_comes_from_makes_no_difference(tmp_path):
    pairs, x = layers()
    named = {}
    for at, (weights, biases) in enumerate(pairs):
        named[f"{2 * at}.weight"], named[f"{2 * at}.bias"] = weights.T, biases
    wanted = dalean.deploy(pairs, x).state_hash
    assert dalean.deploy(named, x).state_hash == wanted
    np.savez(tmp_path / "net.npz", **named)
    assert dalean.deploy(tmp_path / "net.npz", x).state_hash == wanted
    # a safetensors file of halves, as many are: those of bfloat16 are the upper halves of floats
    for kind, bits in (("F16", lambda a: a.astype("<f2")), ("BF16", lambda a: (a.astype("<f4").view("<u4") >> 16).astype("<u2"))):
        parts, head, at = [], {}, 0
        for name, array in named.items():
            parts.append(bits(np.ascontiguousarray(array)).tobytes())
            head[name] = {"dtype": kind, "shape": array.shape, "data_offsets": [at, at + len(parts[-1])]}
            at += len(parts[-1])
        words = json.dumps(head).encode()
        (tmp_path / "net.safetensors").write_bytes(len(words).to_bytes(8, "little") + words + b"".join(parts))
        halves = dalean.signed(dalean.deploy(tmp_path / "net.safetensors", x))
        assert all(np.abs(of - weights).max() < 0.02 * np.abs(weights).max() for (of, _), (weights, _) in zip(halves, pairs))
    kept = dalean.deploy(pairs, x).save(tmp_path / "levels.npz")
    again = dalean.deploy([(w * 0.5, b) for w, b in pairs], x)
    again.restore(kept)
    assert all((again.levels(at, "e") == dalean.deploy(pairs, x).levels(at, "e")).all() for at in range(3))


FLAWS = {"device": {"faults": {"stuck_any": 0.1}, "read_noise": {"sigma_cells": 1.0}, "programming": {"sigma": [0.02]}}}
DRIFT = {"device.drift": {"start_s": 20.0, "change": -0.05, "change_spread": 0.02}}


def kept(net):
    """Everything that a network is."""
    return net.state_hash, net.receipt(), {name: array.tolist() for name, array in net.all_levels().items()}


@pytest.mark.parametrize("to", ["pairs", "dual"])
def test_chips_have_what_their_numbers_say(to):
    """Chip k holds what a network with the seed k holds that was loaded alike: its stuck cells, and what its loads left."""
    pairs, x = layers()
    chip = dalean.Chip("ideal", FLAWS | DRIFT)
    net, seen = dalean.deploy(pairs, x, chip, to=to), []

    def score(net):
        seen.append(net.all_levels())
        return (sums(net, x).argmax(1) == forward(pairs, x).argmax(1)).mean()

    before = kept(net)
    chips = net.on_chips(score, samples=3, progress=False)
    assert kept(net) == before
    assert chips["chip"] == [1, 2, 3] and chips["after_s"] == [None] * 3 and chips.of == "score"
    for number, levels in enumerate(seen, 1):
        like = dalean.deploy(pairs, x, chip, to=to, seed=number).all_levels()
        assert all((levels[name] == like[name]).all() for name in like)
    assert any((seen[0][name] != seen[1][name]).any() for name in seen[0])
    # by its number, whatever was read before; chip 0 is the one that it is on
    assert net.on_chips(score, chip=3, progress=False).rows == chips.rows[2:]
    seen.clear()
    assert net.on_chips(score, progress=False)["chip"] == [0]
    assert {name: array.tolist() for name, array in seen[0].items()} == before[2]


def test_levels_of_a_network_fall_with_time_and_come_back():
    pairs, x = layers()
    net = dalean.deploy(pairs, x, dalean.Chip("ideal", {"device.drift": {"start_s": 20.0, "exponent": [0.05]}}))
    total = lambda net: float(sum(array.sum(dtype=float) for array in net.all_levels().values()))
    whole = total(net)
    chips = net.on_chips(total, after=[20, "1h", "1d", "1y"], progress=False)
    assert chips["score"][0] == whole and chips["score"] == sorted(chips["score"], reverse=True)
    assert abs(chips["score"][-1] / whole - (31_557_600 / 20) ** -0.05) < 0.02 and chips["after_s"] == [20, 3600, 86_400, 31_557_600]
    assert [one["mean"] for one in chips.summary] == chips["score"]
    # what drift took from all cells of a layer alike, a factor gives back
    size = lambda net: float(np.abs(sums(net, x)).mean())
    plain, made_up = (net.on_chips(size, after="1y", compensate=on, progress=False)["score"][0] for on in (False, True))
    assert plain < 0.5 * size(net) and abs(made_up / size(net) - 1) < 0.05
    assert total(net) == whole


def test_what_was_written_on_the_chip_is_what_others_are_loaded_with():
    pairs, x = layers()
    chip = dalean.Chip("ideal", {"device.programming.sigma": [0.05]})
    net = dalean.deploy(pairs, x, chip, overrides={"learning.batch": 20}, updates=9)
    asked = net.on_chips(lambda net: net.levels(0, "e").sum(), chip=1, progress=False)["score"]
    for some in np.arange(180).reshape(-1, 20):
        net.read(x[some])
        net.deliver(net.error_words(np.tile([255, 0, 0, -255], (20, 1))))
        net.write()
    before = kept(net)
    moved = net.on_chips(lambda net: net.levels(0, "e").sum(), chip=1, progress=False)["score"]
    assert moved != asked and kept(net) == before

    def trains_there(net):
        net.read(x[:20])
        net.deliver(net.error_words(np.tile([255, 0, 0, -255], (20, 1))))
        net.write()
        net.load(0, "e", np.zeros_like(net.levels(0, "e")))
        return net.updates

    assert net.on_chips(trains_there, samples=2, progress=False)["score"] == [10, 10]
    assert kept(net) == before


def test_a_run_and_its_levels_in_a_network_are_worth_the_same_on_every_chip(tmp_path):
    """The two doors to other chips, and to their drift, agree: a run's test set read by the program, and by the caller."""
    datasets = pytest.importorskip("sklearn.datasets")
    x, labels = datasets.load_digits(return_X_y=True)
    keys = {"network.hidden": [16], "learning.epochs": 1, "learning.batch": 32}
    flaws = {"device.faults.stuck_any": 0.05, "device.programming.sigma": [0.05], **DRIFT}
    run = dalean.train(keys, out=tmp_path, seed=5, progress=False)
    net = dalean.Network([64, 16, 10], dalean.Chip("ideal", flaws), seed=5)
    net.restore_levels(run.path / "checkpoint.safetensors")
    codes = np.floor(x * 255 / 16 + 0.5).astype(np.uint8)
    right = lambda net: float(np.mean(sums(net, codes).argmax(1) == labels))
    asked = {"samples": 3, "after": ["1h", "1y"], "compensate": True, "progress": False}
    wanted, found = run.on_chips(overrides=flaws, **asked), net.on_chips(right, **asked)
    assert wanted["chip"] == found["chip"] and wanted["after_s"] == found["after_s"]
    assert np.array_equal(wanted["test_accuracy"], found["score"]), (wanted.rows, found.rows)
    assert np.ptp(found["score"]) > 0.01


def test_what_cannot_be_asked_of_chips():
    pairs, x = layers()
    plain, faulty = dalean.deploy(pairs, x), dalean.deploy(pairs, x, dalean.Chip("ideal", FLAWS))
    for net, score, asked, words in [
        (plain, len, {"samples": 2}, "all alike"),
        (plain, len, {"after": "1d"}, "`hw.device.drift` is missing"),
        (faulty, len, {"samples": 2, "compensate": True}, "say with after"),
        (faulty, lambda net: "good", {"samples": 2}, "score gives 'good'"),
        (faulty, lambda net: net.on_chips(len, samples=2), {"samples": 2}, "on_chips is in progress"),
    ]:
        before = kept(net)
        with pytest.raises(dalean.Error, match=words):
            net.on_chips(score, **asked, progress=False)
        assert kept(net) == before

    def fails(net):
        net.load(0, "e", np.zeros_like(net.levels(0, "e")))
        raise ZeroDivisionError

    before = kept(faulty)
    with pytest.raises(ZeroDivisionError):
        faulty.on_chips(fails, samples=2, progress=False)
    assert kept(faulty) == before


@pytest.mark.parametrize("activation", ["relu", "sigmoid"])
@pytest.mark.parametrize("to", ["pairs", "dual"])
def test_a_module_of_pytorch(tmp_path, to, activation):
    """As a module, as its state, in a file of its state and in other precisions: the same chip as from NumPy, and the same answers."""
    torch = pytest.importorskip("torch")
    torch.manual_seed(1)
    unit = {"relu": torch.nn.ReLU, "sigmoid": torch.nn.Sigmoid}[activation]
    parts = [torch.nn.Flatten(), torch.nn.Linear(6, 9), unit(), torch.nn.Dropout(0.5), torch.nn.Linear(9, 4)]
    module, (_, x) = torch.nn.Sequential(*parts), layers()
    options = {"to": to, "activation": activation, "seed": 3}
    net = dalean.deploy(module, x, **options)
    deployed = net.state_hash
    assert module.training and all(one.requires_grad for one in module.parameters()), "the module is left as it was"
    with torch.no_grad():
        wanted = module.eval()(torch.tensor(x, dtype=torch.float32)).numpy()
    found = sums(net, x)
    assert all(np.corrcoef(wanted[:, of], found[:, of])[0, 1] > 0.98 for of in range(4))
    assert np.abs(dalean.outputs(net) - wanted).max() < 0.1 * np.ptp(wanted)
    state = module.state_dict()
    arrays = [(state[f"{at}.weight"].numpy().T, state[f"{at}.bias"].numpy()) for at in (1, 4)]
    assert dalean.deploy(arrays, x, **options).state_hash == deployed
    assert dalean.deploy(state, x, **options).state_hash == deployed
    assert dalean.deploy(module, torch.tensor(x), **options).state_hash == deployed
    np.savez(tmp_path / "net.npz", **state)
    assert dalean.deploy(tmp_path / "net.npz", x, **options).state_hash == deployed
    half = module.to(torch.bfloat16)
    assert dalean.deploy(half, x, **options).deployment[0].weight_max == net.deployment[0].weight_max
    # on with it: other chips, in one call
    chip = dalean.Chip("ideal", FLAWS)
    same = lambda net: float(np.mean(sums(net, x).argmax(1) == wanted.argmax(1)))
    assert len(dalean.deploy(half, x, chip, **options).on_chips(same, samples=3, progress=False)) == 3


def test_modules_of_pytorch_that_a_chip_cannot_be(tmp_path):
    torch = pytest.importorskip("torch")
    nn, (_, x) = torch.nn, layers()
    for parts, words in [
        ([nn.Linear(6, 9), nn.Tanh(), nn.Linear(9, 4)], "Tanh"),
        ([nn.Linear(6, 9), nn.Sigmoid(), nn.Linear(9, 4)], "Sigmoid"),
        ([nn.Linear(6, 9), nn.BatchNorm1d(9), nn.ReLU(), nn.Linear(9, 4)], "BatchNorm1d"),
        ([nn.Linear(6, 9), nn.ReLU(), nn.Linear(8, 4)], "layer 1 has weights"),
        ([nn.Linear(6, 9), nn.Linear(9, 4)], "ReLU"),
        ([nn.Linear(6, 9), nn.ReLU(), nn.Linear(9, 4), nn.ReLU()], "ReLU"),
        ([nn.ReLU()], "are none"),
    ]:
        with pytest.raises(dalean.ArrayError, match=words):
            dalean.deploy(nn.Sequential(*parts), x)


def test_standardised_inputs_fold_into_the_first_layer():
    """As docs/python.md has it: what a network was trained on has a sign, what a chip is shown lies from 0 to 1."""
    pairs, x = layers(seed=5)
    mean, sd = x.mean(0), x.std(0)
    wanted = forward(pairs, (x - mean) / sd)
    (w, b), *rest = pairs
    net = dalean.deploy([(w / sd[:, None], b - (mean / sd) @ w), *rest], x, dalean.Chip("ideal", {"cell.level_bits": 12}))
    assert np.corrcoef(wanted.ravel(), sums(net, x).ravel())[0, 1] > 0.99
    with pytest.raises(dalean.ArrayError, match="floats lie in 0 to 1"):
        dalean.deploy(pairs, (x - mean) / sd)


@pytest.mark.parametrize("to", ["pairs", "dual"])
def test_what_is_shown_may_have_a_sign(to):
    pairs, x = layers()
    x = 2 * x - 1
    net = dalean.deploy(pairs, x, dalean.Chip("ideal", {"cell.level_bits": 10}), to=to, signed=True)
    wanted, found = forward(pairs, x), sums(net, x)
    assert all(np.corrcoef(wanted[:, of], found[:, of])[0, 1] > 0.995 for of in range(4))
    assert np.abs(dalean.outputs(net) - wanted).max() < 0.05 * np.ptp(wanted)
    codes = np.sign(x) * np.floor(np.abs(x) * 255 + 0.5)
    assert (sums(net, codes.astype(np.int16)) == found).all()
    chips = dalean.deploy(pairs, x, dalean.Chip("ideal", FLAWS), to=to, signed=True)
    assert len(set(chips.on_chips(lambda net: sums(net, x).std(), samples=3, progress=False)["score"])) == 3


@pytest.mark.parametrize(
    ("given", "options", "words"),
    [
        ([], {}, "are none"),
        ([np.zeros((6, 3)), np.zeros((4, 2))], {}, "layer 1 has weights of shape"),
        ([(np.zeros((6, 3)), np.zeros(4))], {}, "biases of"),
        ([np.full((6, 3), np.nan)], {}, "no finite number"),
        ({"0.weight": np.zeros((3, 6)), "1.scale": np.zeros(3)}, {}, "name '1.scale'"),
        ([np.zeros((5, 3))], {}, "x has the shape"),
        ([np.zeros((6, 3)) * 1j], {}, "the weights of layer 0 cannot be read: complex"),
        ([(np.zeros((6, 3)), ["a", "b", "c"])], {}, "the biases of layer 0 cannot be read"),
        ([np.zeros((6, 3))], {"to": "triples"}, "triples"),
        ([np.zeros((6, 3))], {"to": "dual", "rule": "bp"}, "rule is 'bp'"),
        ([np.zeros((6, 3))], {"activation": "tanh"}, "tanh"),
        ([np.zeros((6, 3))], {"quantile": 0}, "quantile"),
        (7, {}, "is a int"),
    ],
)
def test_what_is_no_network_is_refused(given, options, words):
    with pytest.raises(dalean.ArrayError, match=words):
        dalean.deploy(given, np.zeros((2, 6)), **options)


def test_a_network_that_was_not_deployed_has_no_signed_weights():
    with pytest.raises(dalean.ArrayError, match="was not deployed"):
        dalean.signed(dalean.Network([4, 3]))


def example(examples, name):
    spec = importlib.util.spec_from_file_location(name, examples / f"{name}.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_example_of_chips(examples, monkeypatch):
    monkeypatch.syspath_prepend(examples)
    told = example(examples, "chips").main(samples=6)
    for to in ("pairs", "dual"):
        plain, made_up = told[to, False].summary, told[to, True].summary
        # nothing has moved at the start of the law; then it falls
        assert plain[0] == made_up[0] and 0.5 < plain[0]["mean"] < 0.89
        assert plain[0]["mean"] > plain[1]["mean"] > plain[2]["mean"] and made_up[2]["mean"] >= plain[2]["mean"]
        assert len(told[to, True]) == 18 and told[to, True]["chip"] == [chip for chip in range(1, 7) for _ in range(3)]


def test_the_example(examples):
    told = example(examples, "deploy").main(epochs=2)
    for to in ("pairs", "dual"):
        before, after = told[to][0], told[to][-1]
        # a sign that is wrong somewhere answers by chance, 0.1; errors of the wrong sign lose a third in an epoch
        assert 0.7 < before < told["float"][0] and after > before
