"""Floor 2: learners in the style of scikit-learn and Gymnasium."""

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


def test_episodes_may_be_begun_by_hand():
    a = policy().learn(vector("CartPole-v1", 4), 512)
    b = policy().learn(vector("CartPole-v1", 4, "DISABLED"), 512)
    # which episodes are drawn differs, what is learnt from does not
    assert a.steps == b.steps


def test_what_cannot_be_learnt_on_is_refused():
    with pytest.raises(dalean.EnvironmentFault, match="SAME_STEP"):
        policy().learn(vector("CartPole-v1", 2, "NEXT_STEP"), 64)
    env = vector("CartPole-v1", 2)
    step = env.step
    env.step = lambda actions: (step(actions)[0] * np.nan, *step(actions)[1:])
    with pytest.raises(dalean.EnvironmentFault, match="shows NaN"):
        policy().learn(env, 64)
