"""Networks that were trained elsewhere, on the chip."""

import importlib.util

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
    kept = dalean.deploy(pairs, x).save(tmp_path / "levels.npz")
    again = dalean.deploy([(w * 0.5, b) for w, b in pairs], x)
    again.restore(kept)
    assert all((again.levels(at, "e") == dalean.deploy(pairs, x).levels(at, "e")).all() for at in range(3))


def test_a_module_of_pytorch():
    torch = pytest.importorskip("torch")
    net = torch.nn.Sequential(torch.nn.Linear(6, 9), torch.nn.ReLU(), torch.nn.Linear(9, 4))
    _, x = layers()
    found = sums(dalean.deploy(net, x), x)
    wanted = net(torch.tensor(x, dtype=torch.float32)).detach().numpy()
    assert np.mean(found.argmax(1) == wanted.argmax(1)) > 0.9
    with pytest.raises(dalean.ArrayError, match="Tanh"):
        dalean.deploy(torch.nn.Sequential(torch.nn.Linear(6, 9), torch.nn.Tanh()), x)


@pytest.mark.parametrize(
    ("given", "options", "words"),
    [
        ([], {}, "are none"),
        ([np.zeros((6, 3)), np.zeros((4, 2))], {}, "layer 1 has weights of shape"),
        ([(np.zeros((6, 3)), np.zeros(4))], {}, "biases of"),
        ([np.full((6, 3), np.nan)], {}, "no finite number"),
        ({"0.weight": np.zeros((3, 6)), "1.scale": np.zeros(3)}, {}, "name '1.scale'"),
        ([np.zeros((5, 3))], {}, "x has the shape"),
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


def test_the_example(examples):
    spec = importlib.util.spec_from_file_location("deploy", examples / "deploy.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    told = made.main(epochs=2)
    for to in ("pairs", "dual"):
        before, after = told[to][0], told[to][-1]
        # a sign that is wrong somewhere answers by chance, 0.1; errors of the wrong sign lose a third in an epoch
        assert 0.7 < before < told["float"][0] and after > before
