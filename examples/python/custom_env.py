"""An environment of one's own, of which a policy sees lines that are on or off: a row of the first crossbar each.

    python examples/python/custom_env.py

A ball falls through 7 columns, a bat below moves left, stays or moves right; whoever is under the ball at the end gets 1, else -1.
A vector environment of Gymnasium's kind: many side by side, in NumPy. Chance gets one ball in seven.
"""

import gymnasium
import numpy as np

import dalean

COLUMNS, ROWS = 7, 6


class Catch(gymnasium.vector.VectorEnv):
    """Balls that fall, each an episode of its own; the next one falls in the step after."""

    metadata = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}

    def __init__(self, count: int) -> None:
        self.num_envs = count
        self.single_observation_space = gymnasium.spaces.MultiBinary(ROWS * COLUMNS + COLUMNS)
        self.single_action_space = gymnasium.spaces.Discrete(3)

    def reset(self, *, seed=None, options=None):
        self.rng = np.random.default_rng(seed)
        self.row, self.column, self.bat = np.zeros((3, self.num_envs), dtype=int)
        self.over = np.ones(self.num_envs, dtype=bool)
        self._begin()
        return self._lines(), {}

    def _begin(self) -> None:
        self.row[self.over] = 0
        self.column[self.over] = self.rng.integers(COLUMNS, size=self.over.sum())
        self.bat[self.over] = self.rng.integers(COLUMNS, size=self.over.sum())
        self.over[:] = False

    def _lines(self) -> dalean.Lines:
        """Two lines of each are on: where the ball is, and where the bat."""
        on = np.stack([self.row * COLUMNS + self.column, ROWS * COLUMNS + self.bat], axis=1)
        return dalean.Lines(on.ravel(), 2 * np.arange(1, self.num_envs + 1))

    def step(self, actions):
        idle = self.over.copy()
        self._begin()
        self.bat = np.where(idle, self.bat, np.clip(self.bat + actions - 1, 0, COLUMNS - 1))
        self.row = np.where(idle, self.row, self.row + 1)
        self.over = ~idle & (self.row == ROWS - 1)
        rewards = np.where(self.over, np.where(self.bat == self.column, 1.0, -1.0), 0.0)
        return self._lines(), rewards, self.over.copy(), np.zeros(self.num_envs, dtype=bool), {}


def main(steps: int = 60_000) -> float:
    """Share of the balls that are caught in the end."""
    policy = dalean.EDPolicy(hidden=(32,), horizon=64, seed=1, overrides={"learning.batch": 128}).learn(Catch(16), steps)
    returns = policy.evaluate(Catch(16), 320, seed=7)
    return float(np.mean(np.array(returns) > 0))


if __name__ == "__main__":
    print(f"{100 * main():.1f} % of the balls are caught")
