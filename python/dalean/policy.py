"""A policy that learns on a simulated chip, on any vector environment of Gymnasium (``pip install "dalean[gym]"``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from . import _dalean
from ._progress import Progress
from ._text import Overrides, settings, text
from .errors import EnvironmentFault

__all__ = ["EDPolicy", "Lines"]


class Lines(NamedTuple):
    """What environments show that have many lines of which few are on: a row of the first crossbar each. A space of such is
    ``MultiBinary``, and an environment may show arrays ``[environment, line]`` of 0 and 1 as well."""

    active: np.ndarray
    """Lines that are on, from 0, environment after environment, rising in each."""
    ends: np.ndarray
    """Where those of each environment end."""


class EDPolicy:
    """An actor and a critic on crossbars, trained by PPO in fixed point.

    ::

        policy = dalean.EDPolicy(hidden=(64, 64), seed=1)
        policy.learn("CartPole-v1", 100_000, envs=8)
        policy.predict(observations)

    :param hidden: units of each hidden layer, of actor and critic.
    :param horizon: steps of an environment in a rollout.
    :param rule: ``"ed"``, ``"ed_non_dalean"``, ``"dfa"``, ``"bp"``.
    :param hw: hardware model, a built-in name or a file.
    :param overrides: any other keys, such as ``{"hw.cell.level_bits": 4, "ppo.gamma": 0.99}``.
    :param seed: seed of all draws of the policy, and of the environments it makes.
    """

    def __init__(
        self,
        hidden: tuple[int, ...] = (64, 64),
        *,
        horizon: int = 128,
        rule: str = "ed",
        hw: str = "ideal",
        overrides: Overrides | None = None,
        seed: int = 1,
        threads: int = 1,
        kernel: str | None = None,
    ) -> None:
        self.hidden, self.horizon, self.rule, self.hw = tuple(hidden), horizon, rule, hw
        self.overrides, self.seed, self.threads, self.kernel = overrides, seed, threads, kernel
        self.epochs: list[dict[str, Any]] = []
        """What came of each epoch: steps, episodes, mean return and length, entropy."""
        self._learner: _dalean.PolicyLearner | None = None

    def learn(
        self,
        env: Any,
        steps: int,
        *,
        envs: int = 8,
        each: Callable[[EDPolicy], Any] | None = None,
        go_on: bytes | None = None,
        progress: bool | None = False,
    ) -> EDPolicy:
        """Learns for so many steps of all environments together, at least.

        An environment that begins its next episode in the step after the one that ended (Gymnasium's default) is idle there: that
        step is one of the rollout, and nothing is learnt from it.

        :param env: a vector environment of any ``AutoresetMode``, or the name of one, of which ``envs`` are made.
        :param each: is called after every epoch; what it keeps of :meth:`checkpoint` is what ``go_on`` takes.
        :param go_on: a checkpoint of the same policy to go on from. Environments begin anew.
        :raises dalean.EnvironmentFault: when it shows what is no finite number, or is of a kind that is not learnt on.
        :raises KeyboardInterrupt: within a batch.
        """
        made = None
        if isinstance(env, str):
            import gymnasium

            mode = gymnasium.vector.AutoresetMode.SAME_STEP
            env = made = gymnasium.make_vec(env, envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
        try:
            return self._learn(env, steps, each, go_on, progress)
        finally:
            if made is not None:
                made.close()

    def _learn(
        self,
        env: Any,
        steps: int,
        each: Callable[[EDPolicy], Any] | None,
        go_on: bytes | None,
        progress: bool | None,
    ) -> EDPolicy:
        begins = _begins(env)
        self._env = _Faces(env)
        learner = self._learner = self._made(env, steps)
        if go_on is not None:
            learner.put_back(go_on)
        self.epochs = []
        scaled, flat = self._env.action, self._env.flat
        idle = np.zeros(env.num_envs, dtype=bool)
        with Progress(progress, "steps") as told:
            while True:
                turn, actions = learner.turn()
                if turn == "act":
                    shown, rewards, over, stop, info = env.step(scaled(actions))
                    shown, reached = flat(shown), None
                    ended = over | stop
                    if ended.any():
                        if begins == "same_step":
                            reached = _reached(shown, ended, info, self._env)
                        elif begins == "next_step":
                            reached = shown
                        else:
                            # what ended is what was shown, and the environment may write over it
                            reached = shown if self._env.lines else shown.copy()
                            begun, _ = env.reset(options={"reset_mask": ended})
                            shown = flat(begun)
                    learner.take(shown, rewards, over, stop, reached, idle if idle.any() else None)
                    if begins == "next_step":
                        idle = ended
                elif turn == "begin":
                    shown, _ = env.reset(seed=self.seed)
                    learner.begin(flat(shown))
                    idle = np.zeros(env.num_envs, dtype=bool)
                elif turn == "learn":
                    epoch = learner.learn()
                    if epoch is not None:
                        self.epochs.append(epoch)
                        if each is not None:
                            each(self)
                    told("update", {"epoch": 0, "epochs": 1, "done": learner.steps, "total": steps})
                else:
                    return self

    def _made(self, env: Any, steps: int) -> _dalean.PolicyLearner:
        faces = self._env
        keys = {
            "task": "policy",
            # what is left unsaid depends on it
            "environment.id": _like(faces.name, faces.discrete),
            "environment.count": env.num_envs,
            "environment.horizon": self.horizon,
            "environment.steps": steps,
            "network.hidden": list(self.hidden),
            "learning.rule": self.rule,
        }
        return _dalean.PolicyLearner(
            "EDPolicy",
            text(keys),
            self.hw,
            settings(self.overrides),
            self.seed,
            faces.name,
            faces.shown,
            faces.shown if faces.lines else None,
            faces.discrete,
            faces.taken,
            faces.steps_max,
            self.threads,
            self.kernel,
        )

    def predict(self, observations: Any, step: int = 0) -> np.ndarray:
        """Actions for observations, ``[sample, ...]`` or one of them: the likeliest, as the environment takes them."""
        learner = self._trained()
        if isinstance(observations, Lines):
            one, shown, samples = False, observations, len(observations.ends)
        else:
            shown = np.asarray(observations, dtype=np.uint8 if self._env.lines else np.float64)
            one = shown.size == self._env.shown and shown.shape == self._env.shape
            shown = self._env.flat(shown.reshape(-1, self._env.shown))
            samples = len(shown.ends) if self._env.lines else len(shown)
        taken = []
        for first in range(0, samples, learner.count):
            some = self._env.some(shown, first, learner.count)
            taken.append(self._env.action(learner.answer(some, step))[: samples - first])
        actions = np.concatenate(taken) if taken else np.zeros((0,))
        return actions[0] if one else actions

    def evaluate(self, env: Any, episodes: int = 10, *, envs: int = 8, seed: int = 0) -> list[float]:
        """Returns of episodes that are not learnt from: of each environment as many, so that short ones are not preferred."""
        if isinstance(env, str):
            import gymnasium

            mode = gymnasium.vector.AutoresetMode.SAME_STEP
            env = gymnasium.make_vec(env, envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
        begins = _begins(env)
        shown, _ = env.reset(seed=seed)
        sums, step = np.zeros(env.num_envs), 0
        left = np.array([len(range(which, episodes, env.num_envs)) for which in range(env.num_envs)])
        returns: list[float] = []
        idle = np.zeros(env.num_envs, dtype=bool)
        while left.any():
            shown, rewards, over, stop, _ = env.step(self.predict(shown, step))
            sums += np.where(idle, 0, rewards)
            ended = over | stop
            told = ended & (left > 0)
            returns.extend(float(value) for value in sums[told])
            left -= told
            sums[ended] = 0
            if begins == "disabled" and ended.any():
                shown, _ = env.reset(options={"reset_mask": ended})
            elif begins == "next_step":
                idle = ended
            step += 1
        return returns

    def _trained(self) -> _dalean.PolicyLearner:
        if self._learner is None:
            raise RuntimeError("the policy has learnt nothing; call learn first")
        return self._learner

    @property
    def steps(self) -> int:
        """Steps of all environments that were learnt from."""
        return self._trained().steps

    @property
    def state_hash(self) -> str:
        """BLAKE3 of levels, statistics and counters."""
        return self._trained().state_hash()

    @property
    def config(self) -> str:
        """The resolved configuration, as TOML. Of environments that are not the program's own, ``environment.id`` is the one whose
        defaults hold."""
        return self._trained().config

    def checkpoint(self) -> bytes:
        """The state as safetensors."""
        return self._trained().checkpoint()


def _wrong(found: str, allowed: str) -> EnvironmentFault:
    return EnvironmentFault(f"the environment {found}; {allowed}", "the environment", found, allowed)


def _begins(env: Any) -> str:
    """When episodes that ended begin again: in the same step, in the next one, or (disabled) by `reset`."""
    import gymnasium

    modes = gymnasium.vector.AutoresetMode
    mode = env.metadata.get("autoreset_mode")
    for known, name in ((modes.SAME_STEP, "same_step"), (modes.NEXT_STEP, "next_step"), (modes.DISABLED, "disabled")):
        if mode == known:
            return name
    raise _wrong(
        f"does not say when episodes begin again ({mode})",
        'metadata["autoreset_mode"] is one of gymnasium.vector.AutoresetMode: SAME_STEP, NEXT_STEP, DISABLED',
    )


def _like(name: str, discrete: bool) -> str:
    """The environment of the program whose defaults hold: that of the same name, else one that takes the same kind of actions."""
    known = {"CartPole-v1": True, "Acrobot-v1": True, "Pendulum-v1": False, "MountainCarContinuous-v0": False}
    return name if known.get(name) == discrete else "CartPole-v1" if discrete else "MountainCarContinuous-v0"


class _Faces:
    """What an environment shows and takes."""

    def __init__(self, env: Any) -> None:
        import gymnasium

        spaces = gymnasium.spaces
        shown, taken = env.single_observation_space, env.single_action_space
        self.lines = isinstance(shown, spaces.MultiBinary)
        if not self.lines and not isinstance(shown, spaces.Box):
            raise _wrong(f"shows {shown}", "observations are arrays of numbers (Box) or of lines (MultiBinary): flatten it")
        self.shape, self.shown = shown.shape, int(np.prod(shown.shape))
        if isinstance(taken, spaces.Discrete):
            self.discrete, self.taken, self.first = True, int(taken.n), int(taken.start)
        elif isinstance(taken, spaces.Box) and np.isfinite(taken.low).all() and np.isfinite(taken.high).all():
            self.discrete, self.taken = False, int(np.prod(taken.shape))
            self.low, self.half = taken.low.astype(np.float64), (taken.high.astype(np.float64) - taken.low) / 2
            self.space = taken
        else:
            raise _wrong(f"takes {taken}", "actions are one of some (Discrete), or numbers with bounds (Box)")
        spec = getattr(env, "spec", None)
        self.name = getattr(spec, "id", None) or type(env).__name__
        self.steps_max = getattr(spec, "max_episode_steps", None) or 1_000_000

    def flat(self, shown: Any) -> Any:
        """What environments show, as the learner takes it."""
        if not self.lines:
            return shown.reshape(len(shown), self.shown)
        if isinstance(shown, Lines):
            return shown
        which, active = np.nonzero(shown.reshape(len(shown), self.shown))
        return Lines(active, np.searchsorted(which, np.arange(len(shown)), side="right"))

    def some(self, shown: Any, first: int, count: int) -> Any:
        """So many of what is shown, and of nothing where there are no more."""
        if not self.lines:
            some = shown[first : first + count]
            return np.concatenate([some, np.zeros((count - len(some), self.shown))])
        ends = np.concatenate([[0], shown.ends])[first : first + count + 1]
        active = shown.active[ends[0] : ends[-1]]
        return Lines(active, np.pad(ends[1:] - ends[0], (0, count + 1 - len(ends)), constant_values=len(active)))

    def action(self, taken: np.ndarray) -> np.ndarray:
        """Actions as the environment takes them."""
        if self.discrete:
            return taken + self.first if self.first else taken
        scaled = self.low + (taken.reshape(len(taken), *self.space.shape) + 1.0) * self.half
        return scaled.astype(self.space.dtype)


def _reached(shown: Any, ended: np.ndarray, info: dict[str, Any], faces: _Faces) -> Any:
    """What episodes that ended had reached."""
    final = info.get("final_obs", info.get("final_observation"))
    if final is None:
        raise _wrong("ended an episode without saying what it reached", 'give it as info["final_obs"]')
    if isinstance(final, Lines):
        return final
    reached = np.zeros((len(ended), faces.shown)) if faces.lines else shown.copy()
    for at in np.flatnonzero(ended):
        reached[at] = np.asarray(final[at]).reshape(faces.shown)
    return faces.flat(reached) if faces.lines else reached
