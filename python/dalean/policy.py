"""A policy that learns on a simulated chip, on any vector environment of Gymnasium (``pip install "dalean[gym]"``)."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _dalean
from ._progress import Progress
from ._text import Overrides, settings, text
from .errors import EnvironmentFault

__all__ = ["EDPolicy"]


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
        progress: bool | None = False,
    ) -> EDPolicy:
        """Learns for so many steps of all environments together, at least.

        :param env: a vector environment that begins again in the same step (``AutoresetMode.SAME_STEP``) or not by itself
            (``DISABLED``); or the name of one, of which ``envs`` are made.
        :raises dalean.EnvironmentFault: when it shows what is no finite number, or is of a kind that is not learnt on.
        :raises KeyboardInterrupt: within a batch.
        """
        made = None
        if isinstance(env, str):
            import gymnasium

            mode = gymnasium.vector.AutoresetMode.SAME_STEP
            env = made = gymnasium.make_vec(env, envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
        try:
            return self._learn(env, steps, progress)
        finally:
            if made is not None:
                made.close()

    def _learn(self, env: Any, steps: int, progress: bool | None) -> EDPolicy:
        masked = _begins_by_hand(env)
        self._env = _Faces(env)
        learner = self._learner = self._made(env, steps)
        self.epochs = []
        scaled, flat = self._env.action, self._env.flat
        with Progress(progress, "steps") as told:
            while True:
                turn, actions = learner.turn()
                if turn == "act":
                    shown, rewards, over, stop, info = env.step(scaled(actions))
                    shown, reached = flat(shown), None
                    ended = over | stop
                    if ended.any():
                        if masked:
                            # what ended is what was shown
                            reached = shown.copy()
                            begun, _ = env.reset(options={"reset_mask": ended})
                            shown = flat(begun)
                        else:
                            reached = _reached(shown, ended, info, self._env)
                    learner.take(shown, rewards, over, stop, reached)
                elif turn == "begin":
                    shown, _ = env.reset(seed=self.seed)
                    learner.begin(flat(shown))
                elif turn == "learn":
                    epoch = learner.learn()
                    if epoch is not None:
                        self.epochs.append(epoch)
                    told("update", {"epoch": 0, "epochs": 1, "done": learner.steps, "total": steps})
                else:
                    return self

    def _made(self, env: Any, steps: int) -> _dalean.PolicyLearner:
        keys = {
            "task": "policy",
            "environment.count": env.num_envs,
            "environment.horizon": self.horizon,
            "environment.steps": steps,
            "network.hidden": list(self.hidden),
            "learning.rule": self.rule,
        }
        faces = self._env
        return _dalean.PolicyLearner(
            "EDPolicy",
            text(keys),
            self.hw,
            settings(self.overrides),
            self.seed,
            faces.name,
            faces.shown,
            faces.discrete,
            faces.taken,
            faces.steps_max,
            self.threads,
            self.kernel,
        )

    def predict(self, observations: Any, step: int = 0) -> np.ndarray:
        """Actions for observations, ``[sample, ...]`` or one of them: the likeliest, as the environment takes them."""
        learner = self._trained()
        shown = np.asarray(observations, dtype=np.float64)
        one = shown.size == self._env.shown and shown.shape == self._env.shape
        shown = shown.reshape(-1, self._env.shown)
        taken = []
        for first in range(0, len(shown), learner.count):
            some = shown[first : first + learner.count]
            full = np.concatenate([some, np.zeros((learner.count - len(some), shown.shape[1]))])
            taken.append(self._env.action(learner.answer(full, step))[: len(some)])
        actions = np.concatenate(taken) if taken else np.zeros((0,))
        return actions[0] if one else actions

    def evaluate(self, env: Any, episodes: int = 10, *, envs: int = 8, seed: int = 0) -> list[float]:
        """Returns of episodes that are not learnt from."""
        if isinstance(env, str):
            import gymnasium

            mode = gymnasium.vector.AutoresetMode.SAME_STEP
            env = gymnasium.make_vec(env, envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
        masked = _begins_by_hand(env)
        shown, _ = env.reset(seed=seed)
        returns, sums, step = [], np.zeros(env.num_envs), 0
        while len(returns) < episodes:
            shown, rewards, over, stop, _ = env.step(self.predict(shown, step))
            sums += rewards
            ended = over | stop
            returns.extend(float(value) for value in sums[ended])
            sums[ended] = 0
            if masked and ended.any():
                shown, _ = env.reset(options={"reset_mask": ended})
            step += 1
        return returns[:episodes]

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

    def checkpoint(self) -> bytes:
        """The state as safetensors."""
        return self._trained().checkpoint()


def _wrong(found: str, allowed: str) -> EnvironmentFault:
    return EnvironmentFault(f"the environment {found}; {allowed}", "the environment", found, allowed)


def _begins_by_hand(env: Any) -> bool:
    """Whether episodes that ended are begun again by `reset`."""
    import gymnasium

    modes = gymnasium.vector.AutoresetMode
    mode = env.metadata.get("autoreset_mode")
    if mode not in (modes.SAME_STEP, modes.DISABLED):
        raise _wrong(
            f"begins again in the step after the one that ended ({mode})",
            "that step would be one that nobody acted in: make it with "
            'gymnasium.make_vec(id, n, vector_kwargs={"autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP})',
        )
    return mode == modes.DISABLED


class _Faces:
    """What an environment shows and takes."""

    def __init__(self, env: Any) -> None:
        import gymnasium

        spaces = gymnasium.spaces
        shown, taken = env.single_observation_space, env.single_action_space
        if not isinstance(shown, spaces.Box):
            raise _wrong(f"shows {shown}", "observations are arrays of numbers (Box): flatten it")
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

    def flat(self, shown: np.ndarray) -> np.ndarray:
        return shown.reshape(len(shown), self.shown)

    def action(self, taken: np.ndarray) -> np.ndarray:
        """Actions as the environment takes them."""
        if self.discrete:
            return taken + self.first if self.first else taken
        scaled = self.low + (taken.reshape(len(taken), *self.space.shape) + 1.0) * self.half
        return scaled.astype(self.space.dtype)


def _reached(shown: np.ndarray, ended: np.ndarray, info: dict[str, Any], faces: _Faces) -> np.ndarray:
    """What episodes that ended had reached."""
    final = info.get("final_obs", info.get("final_observation"))
    if final is None:
        raise _wrong("ended an episode without saying what it reached", 'give it as info["final_obs"]')
    reached = shown.copy()
    for at in np.flatnonzero(ended):
        reached[at] = np.asarray(final[at]).reshape(faces.shown)
    return reached
