"""Floor 2: learners in the style of scikit-learn and Gymnasium."""

import importlib.util
import pickle

import numpy as np
import pytest

import dalean


def digits():
    datasets = pytest.importorskip("sklearn.datasets")
    x, y = datasets.load_digits(return_X_y=True)
    return x[:1000], y[:1000], x[1000:], y[1000:]


def test_a_classifier_learns_digits():
    x, y, test, answers = digits()
    made = dalean.EDClassifier(hidden=(64,), epochs=6)
    assert made.fit(x, y) is made and made.n_iter_ == 6 and len(made.correct_) == 6
    # what is read later is counted too
    learnt = made.state_hash_
    assert made.score(test, answers) > 0.8
    assert made.decision_function(test).shape == (797, 10)
    again = pickle.loads(pickle.dumps(made))
    assert (again.predict(test) == made.predict(test)).all()
    assert again.state_hash_ == made.state_hash_
    other = dalean.EDClassifier(hidden=(64,), epochs=6, threads=2, kernel="scalar").fit(x, y)
    assert other.state_hash_ == learnt != made.state_hash_
    words = np.array(list("abcdefghij"))[y]
    assert set(dalean.EDClassifier(hidden=(8,), epochs=1).fit(x, words).predict(test)) <= set("abcdefghij")
    with pytest.raises(dalean.ConfigError, match="learning.batch"):
        dalean.EDClassifier(batch=0).fit(x, y)


EXPECTED = {}
"""Checks of scikit-learn that it does not pass, with the reason."""


def test_scikit_learn_s_checks():
    pytest.importorskip("sklearn")
    from sklearn.utils.estimator_checks import check_estimator

    outcomes = check_estimator(dalean.EDClassifier(), on_fail=None, expected_failed_checks=EXPECTED)
    by = {}
    for one in outcomes:
        by.setdefault(one["status"], []).append(one["check_name"])
    assert not by.get("failed"), [(one["check_name"], one["exception"]) for one in outcomes if one["status"] == "failed"]
    assert len(by["passed"]) > 40
    assert sorted(by.get("xfail", [])) == sorted(EXPECTED)


def vector(name, count, mode="SAME_STEP"):
    gymnasium = pytest.importorskip("gymnasium")
    mode = getattr(gymnasium.vector.AutoresetMode, mode)
    return gymnasium.make_vec(name, count, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})


def policy(**options):
    return dalean.EDPolicy(hidden=(16,), horizon=32, overrides={"learning.batch": 32}, **options)


@pytest.mark.parametrize("name", ["CartPole-v1", "Pendulum-v1"])
def test_a_policy_learns_on_a_vector_environment(name):
    pytest.importorskip("gymnasium")
    made = policy().learn(name, 1024, envs=4)
    assert made.steps >= 1024 and made.epochs and made.epochs[-1]["steps"] == made.steps
    again = policy(threads=2).learn(vector(name, 4), 1024)
    assert again.state_hash == made.state_hash
    shown, _ = vector(name, 4).reset(seed=3)
    actions = made.predict(shown)
    assert len(actions) == 4 and vector(name, 1).single_action_space.contains(actions[0])
    assert made.predict(shown[0]).shape == actions[0].shape
    assert len(made.predict(np.concatenate([shown] * 3))) == 12
    assert len(made.evaluate(name, 2, envs=2)) == 2


def test_what_is_left_unsaid_is_what_the_kind_of_actions_has():
    """The spread of actions once stood still wherever they are numbers, and its keys were refused."""
    pytest.importorskip("gymnasium")
    made = policy().learn("Pendulum-v1", 1024, envs=4)
    assert len({one["entropy"] for one in made.epochs}) > 1
    assert "gamma = 0.95" in made.config and "log_sigma_rate = 0.003" in made.config and "entropy = 0.0\n" in made.config
    other = vector("Pendulum-v1", 4)
    other.spec = None
    assert "gamma = 0.99" in policy().learn(other, 512).config
    still = policy()
    still.overrides = {**still.overrides, "ppo.log_sigma": -1.0, "ppo.log_sigma_rate": 0.0}
    assert len({one["entropy"] for one in still.learn("Pendulum-v1", 1024, envs=4).epochs}) == 1
    assert "entropy = 0.01\n" in policy().learn("CartPole-v1", 512, envs=4).config


def test_episodes_may_be_begun_by_hand():
    a = policy().learn(vector("CartPole-v1", 4), 512)
    b = policy().learn(vector("CartPole-v1", 4, "DISABLED"), 512)
    # which episodes are drawn differs, what is learnt from does not
    assert a.steps == b.steps


def test_where_no_episode_ends_it_makes_no_difference_when_the_next_one_begins():
    """Catches a step that is taken for one in which nobody acted, or the other way about."""
    hashes = {mode: policy().learn(vector("Pendulum-v1", 4, mode), 640).state_hash for mode in ("SAME_STEP", "NEXT_STEP", "DISABLED")}
    assert len(set(hashes.values())) == 1, hashes


def test_episodes_that_begin_in_the_next_step_are_as_long_as_they_were():
    """Catches idle steps that are counted or learnt from: lengths told are those that the environment had."""
    pytest.importorskip("gymnasium")
    env = vector("CartPole-v1", 4, "NEXT_STEP")
    lengths, going, over = [], np.zeros(4, dtype=int), np.zeros(4, dtype=bool)
    step, reset = env.step, env.reset

    def counted(actions):
        nonlocal going, over
        came = step(actions)
        going = np.where(over, 0, going + 1)
        over = came[2] | came[3]
        lengths.extend(going[over])
        return came

    def begun(**options):
        nonlocal going, over
        going, over = np.zeros(4, dtype=int), np.zeros(4, dtype=bool)
        lengths.clear()
        return reset(**options)

    env.step, env.reset = counted, begun
    made = policy().learn(env, 4096)
    episodes = sum(one["episodes"] for one in made.epochs)
    told = sum(one["episodes"] * one["length_mean"] for one in made.epochs if one["episodes"])
    assert (episodes, round(told)) == (len(lengths), sum(lengths)) and episodes > 20
    again = policy().learn(vector("CartPole-v1", 4, "NEXT_STEP"), 4096)
    assert again.state_hash == made.state_hash
    assert len(again.evaluate(vector("CartPole-v1", 3, "NEXT_STEP"), 7)) == 7


def test_what_was_interrupted_goes_on_from_an_epoch():
    pytest.importorskip("gymnasium")
    kept, steps = [], []

    def each(one):
        kept.append(one.checkpoint())
        steps.append(one.steps)
        if len(kept) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        policy().learn("CartPole-v1", 1024, envs=4, each=each)
    again = policy().learn("CartPole-v1", 1024, envs=4, go_on=kept[-1])
    assert again.epochs[0]["steps"] > steps[-1] and again.steps == 1024
    with pytest.raises(dalean.CheckpointError):
        policy(seed=2).learn("CartPole-v1", 1024, envs=4, go_on=kept[-1])


def example(examples, name):
    spec = importlib.util.spec_from_file_location(name, examples / f"{name}.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_an_environment_of_one_s_own_with_lines(examples):
    gymnasium = pytest.importorskip("gymnasium")
    made = example(examples, "custom_env")
    assert made.main(30_000) > 0.7

    class Dense(made.Catch):
        """The same, showing arrays of 0 and 1."""

        def _lines(self):
            on = super()._lines()
            shown = np.zeros((self.num_envs, made.ROWS * made.COLUMNS + made.COLUMNS), dtype=np.int8)
            shown[np.repeat(np.arange(self.num_envs), 2), on.active] = 1
            return shown

    lines, dense = policy().learn(made.Catch(4), 512), policy().learn(Dense(4), 512)
    assert lines.state_hash == dense.state_hash
    shown, _ = made.Catch(5).reset(seed=3)
    as_array, _ = Dense(5).reset(seed=3)
    assert (lines.predict(shown) == dense.predict(as_array)).all()
    wrong = made.Catch(4)
    wrong._lines = lambda: dalean.Lines(np.array([3, 2] * 4), np.arange(2, 9, 2))
    with pytest.raises(dalean.ArrayError, match="rising"):
        policy().learn(wrong, 64)
    assert isinstance(wrong.single_observation_space, gymnasium.spaces.MultiBinary)


@pytest.mark.parametrize("name", ["HalfCheetah-v5", "Hopper-v5"])
def test_mujoco(name):
    pytest.importorskip("mujoco")
    made = policy().learn(name, 512, envs=4)
    assert made.steps == 512 and policy().learn(name, 512, envs=4).state_hash == made.state_hash


@pytest.mark.filterwarnings("ignore")
def test_envpool():
    envpool = pytest.importorskip("envpool")
    hashes = set()
    for seed in (1, 1, 2):
        env = envpool.make("CartPole-v1", env_type="gymnasium", num_envs=4, seed=seed)
        made = policy().learn(env, 2048)
        assert made.steps == 2048 and made.epochs[-1]["episodes"] > 0
        hashes.add(made.state_hash)
    assert len(hashes) == 2  # what an environment draws follows its own seed


def test_the_paper_s_algorithms(examples, tmp_path, monkeypatch, capsys):
    pytest.importorskip("gymnasium")
    made = example(examples, "paper_rl")
    words = "x --env CartPole-v1 --algorithms ed bp dfa ed_non_dalean es --steps 2048 --hidden 8 --episodes 2 --out rl.jsonl"
    monkeypatch.setattr("sys.argv", words.split())
    made.main()
    told = (tmp_path / "rl.jsonl").read_text()
    assert len(told.splitlines()) == 5
    assert "| CartPole-v1  | BP | 2,048 | 1 |" in capsys.readouterr().out
    # nothing is done twice
    made.main()
    assert (tmp_path / "rl.jsonl").read_text() == told and not list(tmp_path.glob("*.state"))
    # Welch's own two: 3 and 5 degrees of freedom would be those of alike variances
    t, freedom = made.welch((10.0, 2.0, 4), (8.0, 1.0, 6))
    assert round(t, 3) == 1.852 and round(freedom, 2) == 4.02


def test_what_cannot_be_learnt_on_is_refused():
    with pytest.raises(dalean.EnvironmentFault, match="does not say when"):
        unsaid = vector("CartPole-v1", 2)
        unsaid.metadata = {}
        policy().learn(unsaid, 64)
    env = vector("CartPole-v1", 2)
    step = env.step
    env.step = lambda actions: (step(actions)[0] * np.nan, *step(actions)[1:])
    with pytest.raises(dalean.EnvironmentFault, match="shows NaN"):
        policy().learn(env, 64)
