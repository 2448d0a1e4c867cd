"""The paper's second half: five ways to learn a policy, on its environments, beside its figures.

    pip install "./python[mujoco,brax,craftax]"
    python examples/python/paper_rl.py --env brax/halfcheetah --algorithms ed bp --seeds 1 2 3 --steps 1_000_000 --out rl.jsonl
    python examples/python/paper_rl.py --env brax/ant brax/humanoid craftax/Craftax-Symbolic-v1 --seeds 1 2 3 4 5 --steps 50_000_000 --out rl.jsonl
    python examples/python/paper_rl.py --out rl.jsonl --table

Environments: brax/NAME, craftax/NAME, any other name is Gymnasium's (HalfCheetah-v5, Ant-v5). A run is kept in the file when it is
over and is not done again; what was interrupted goes on from its last epoch (beside the file, ending in .state), in new episodes. The
table says what a run had: steps, seconds, and what differs from the paper, which leaves widths, steps and optimiser open.
"""

import argparse
import json
import math
import statistics
import time
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np

import dalean

ALGORITHMS = {"ed": "ED", "ed_non_dalean": "ED, non-Dalean", "bp": "BP", "dfa": "DFA", "es": "ES"}
# mean and standard deviation over 5 seeds, last checkpoint: table of the paper
PAPER = {
    "brax/ant": {"ed": (6891, 835), "bp": (6740, 1781), "ed_non_dalean": (7616, 2031)},
    "brax/halfcheetah": {"ed": (5494, 691), "bp": (3520, 485), "dfa": (5581, 359), "ed_non_dalean": (3498, 1703)},
    "brax/humanoid": {"ed": (6670, 2592), "bp": (8478, 3252), "ed_non_dalean": (9804, 1144)},
    "craftax/Craftax-Symbolic-v1": {"ed": (20.9, 2.9), "bp": (27.0, None), "dfa": (19.8, 1.5), "ed_non_dalean": (23.0, None)},
}
PAPER_SEEDS = 5
# figures of others for these tasks
OTHERS = {
    "craftax/Craftax-Symbolic-v1": "PPO at 1,000,000 steps: 2.2 % of 226, which is 5.0 (Craftax's own board)",
    "HalfCheetah-v5": "PPO at 1,000,000 steps 1867 (CleanRL, v4, one seed), at 10,000,000 6241 (SLM-Lab, 4 seeds)",
    "Ant-v5": "PPO at 10,000,000 steps 2138 (SLM-Lab, 4 seeds)",
    "Humanoid-v5": "PPO at 10,000,000 steps 2661 (SLM-Lab, 4 seeds)",
    "Hopper-v5": "PPO at 4,000,000 steps 1654 (SLM-Lab, 4 seeds)",
}
DIFFERS = """What differs: 8-bit cells, drives and error words, all-integer PPO; 64-64 units a stream unless said; observations split by sign;
a pulse by chance in the direction of a sum in place of the paper's optimiser, which it does not name; steps as printed (the paper gives none:
its Craftax figure of BP is that of a published table at 1,000,000,000). Brax: back end as said, not given in the paper; episodes of an
environment begin in its own first state, as Brax's wrapper has it. Gymnasium's tasks of the same name are others, with other rewards."""
MODES = gymnasium.vector.AutoresetMode


class Jax:
    """Environments written in JAX, side by side, as a vector environment: an episode that ended begins again in the same step."""

    metadata = {"autoreset_mode": MODES.SAME_STEP}

    def __init__(self, name: str, count: int, steps: int, shown: gymnasium.Space, taken: gymnasium.Space) -> None:
        self.num_envs, self.spec = count, SimpleNamespace(id=name, max_episode_steps=steps)
        self.single_observation_space, self.single_action_space = shown, taken

    def close(self) -> None:
        pass


class Brax(Jax):
    """Environments of Brax, of 1000 steps."""

    def __init__(self, name: str, count: int, backend: str) -> None:
        import jax
        from brax import envs

        made = envs.create(name, episode_length=1000, auto_reset=False, batch_size=count, backend=backend)
        box = gymnasium.spaces.Box
        super().__init__(f"brax/{name}", count, 1000, box(-np.inf, np.inf, (made.observation_size,)), box(-1, 1, (made.action_size,)))

        def step(state, first, action):
            now = made.step(state, action)
            over = now.done.astype(bool)

            def begun(old, new):
                return jax.numpy.where(over.reshape((-1,) + (1,) * (new.ndim - 1)), old, new)

            next_ = now.replace(
                pipeline_state=jax.tree.map(begun, first.pipeline_state, now.pipeline_state),
                obs=begun(first.obs, now.obs),
                done=jax.numpy.zeros_like(now.done),
                info={**now.info, "steps": begun(first.info["steps"], now.info["steps"])},
            )
            stopped = now.info["truncation"].astype(bool)
            return next_, (next_.obs, now.reward, over & ~stopped, stopped, now.obs)

        self._reset, self._step, self._key = jax.jit(made.reset), jax.jit(step), jax.random.key

    def reset(self, *, seed=None, options=None):
        self._state = self._first = self._reset(self._key(seed or 0))
        return np.asarray(self._first.obs), {}

    def step(self, actions):
        self._state, came = self._step(self._state, self._first, actions)
        shown, rewards, over, stopped, reached = (np.asarray(one) for one in came)
        return shown, rewards, over, stopped, {"final_obs": reached}


class Craftax(Jax):
    """Environments of Craftax with symbols. Of its numbers, those that say what lies where are lines; each of the others, at the
    end, becomes ten lines, as many of which are on as it has tenths."""

    TENTHS = 10

    def __init__(self, name: str, count: int) -> None:
        import jax
        from craftax.craftax_env import make_craftax_env_from_name

        made = make_craftax_env_from_name(name, auto_reset=False)
        settings = made.default_params
        numbers = made.observation_space(settings).shape[0]
        self._tail = 22 if "Classic" in name else 51
        self._map = numbers - self._tail
        lines = self._map + self.TENTHS * self._tail
        super().__init__(f"craftax/{name}", count, 10_000, gymnasium.spaces.MultiBinary(lines), gymnasium.spaces.Discrete(made.action_space(settings).n))
        self._split, self._key = jax.jit(lambda key: jax.random.split(key, count + 1)), jax.random.key
        self._reset = jax.jit(jax.vmap(made.reset, (0, None)), static_argnums=())
        self._step = jax.jit(jax.vmap(made.step_env, (0, 0, 0, None)))
        self._put = jax.jit(lambda all_, one, at: jax.tree.map(lambda old, new: old.at[at].set(new[0]), all_, one))
        self._settings = settings

    def _lines(self, shown) -> dalean.Lines:
        shown = np.asarray(shown)
        steps = (np.arange(self.TENTHS) + 0.5) / self.TENTHS
        tail = shown[:, self._map :, None] >= steps
        which, active = np.nonzero(np.concatenate([shown[:, : self._map] > 0.05, tail.reshape(len(shown), -1)], axis=1))
        return dalean.Lines(active, np.searchsorted(which, np.arange(len(shown)), side="right"))

    def reset(self, *, seed=None, options=None):
        keys = self._split(self._key(seed or 0))
        self._rng = keys[0]
        shown, self._state = self._reset(keys[1:], self._settings)
        return self._lines(shown), {}

    def step(self, actions):
        keys = self._split(self._rng)
        self._rng = keys[0]
        shown, self._state, rewards, done, _ = self._step(keys[1:], self._state, np.asarray(actions), self._settings)
        done, reached = np.asarray(done), self._lines(shown)
        if done.any():
            shown = np.array(shown)
            for at in np.flatnonzero(done):
                begun, state = self._reset(keys[1 + at : 2 + at], self._settings)
                self._state, shown[at] = self._put(self._state, state, at), np.asarray(begun[0])
        return self._lines(shown), np.asarray(rewards), done, np.zeros_like(done), {"final_obs": reached}


def environment(name: str, count: int, backend: str):
    kind, _, rest = name.partition("/")
    if kind == "brax":
        return Brax(rest, count, backend)
    if kind == "craftax":
        return Craftax(rest, count)
    return gymnasium.make_vec(name, count, vectorization_mode="sync")


def split(shown: np.ndarray, most: int) -> np.ndarray:
    """Standardised numbers as drives without a sign: what is above 0, and what is below."""
    pairs = np.stack([shown, -shown], axis=-1).reshape(len(shown), -1)
    return np.minimum(np.floor(np.clip(pairs, 0, 8) * most / 8 + 0.5), most).astype(np.uint8)


class Evolution:
    """Evolution strategies with the law of docs/MODEL.md 5.6, from outside: a network a candidate, written by loading alone."""

    def __init__(self, hidden, seed: int, pairs: int = 16, step: int = 16, shift: int = 4) -> None:
        self.hidden, self.seed, self.pairs, self.by, self.shift = list(hidden), seed, pairs, step, shift
        self.steps, self.epochs = 0, []

    def learn(self, env, steps: int, each=None) -> "Evolution":
        assert env.num_envs == 2 * self.pairs, "a candidate acts in an environment of its own"
        space = env.single_action_space
        self.discrete = isinstance(space, gymnasium.spaces.Discrete)
        outputs = int(space.n) if self.discrete else int(np.prod(space.shape))
        inputs = int(np.prod(env.single_observation_space.shape))
        self.low, self.half = (0, 0) if self.discrete else (space.low, (space.high - space.low) / 2)
        keys = {"network.bias": "input_row", "network.activation": "rms", "network.weight_max": 0.5}
        make = lambda: dalean.Network([2 * inputs, *self.hidden, max(outputs, 2)], seed=self.seed, overrides=keys)  # noqa: E731
        self.nets, self.outputs = [make() for _ in range(env.num_envs)], outputs
        self.levels = {name: levels.astype(np.int64) for name, levels in self.nets[0].all_levels().items()}
        self.count, self.sums, self.squares = 1e-4, np.zeros(inputs), np.ones(inputs) * 1e-4
        draw = np.random.default_rng(self.seed)
        while self.steps < steps:
            signs = [{name: draw.choice([-1, 1], of.shape) for name, of in self.levels.items()} for _ in range(self.pairs)]
            for at, net in enumerate(self.nets):
                self._load(net, signs[at // 2], self.by if at % 2 == 0 else -self.by)
            seed = int(draw.integers(2**30))
            returns = self._play(env, [seed + at // 2 for at in range(env.num_envs)])
            ranks = np.array([(returns < one).sum() - (returns > one).sum() for one in returns])
            floor, ceiling = self.nets[0].window
            for name in self.levels:
                asked = sum(int(ranks[2 * at] - ranks[2 * at + 1]) * signs[at][name] for at in range(self.pairs))
                dithered = asked + draw.integers(1 << self.shift, size=asked.shape)
                self.levels[name] = np.clip(self.levels[name] + (dithered >> self.shift), floor, ceiling)
            self.epochs.append({"steps": self.steps, "return_mean": float(returns.mean())})
            if each is not None:
                each(self)
        return self

    def _load(self, net, signs, by: int) -> None:
        floor, ceiling = net.window
        net.load_all({name: np.clip(of + by * signs[name], floor, ceiling) for name, of in self.levels.items()})

    def _play(self, env, seeds, learn: bool = True) -> np.ndarray:
        """Returns of one episode in each environment."""
        shown, _ = env.reset(seed=seeds if isinstance(env, gymnasium.vector.VectorEnv) else seeds[0])
        returns, going = np.zeros(env.num_envs), np.ones(env.num_envs, dtype=bool)
        while going.any():
            shown, rewards, over, stopped, _ = env.step(self._act(np.asarray(shown, dtype=np.float64), learn and going))
            returns += np.where(going, rewards, 0)
            self.steps += int(going.sum()) if learn else 0
            going &= ~(over | stopped)
        return returns

    def _act(self, shown: np.ndarray, seen) -> np.ndarray:
        shown = shown.reshape(len(self.nets), -1)
        if np.any(seen):
            some = shown[seen]
            self.count, self.sums, self.squares = self.count + len(some), self.sums + some.sum(0), self.squares + (some**2).sum(0)
        mean = self.sums / self.count
        codes = split((shown - mean) / np.sqrt(np.maximum(self.squares / self.count - mean**2, 1e-6)), self.nets[0].code_max)
        for net, one in zip(self.nets, codes, strict=True):
            net.read(one, learn=False)
        said = np.stack([net.accumulators()[0, : self.outputs] for net in self.nets]) * (0.5 / (256 * 32))
        return said.argmax(1) if self.discrete else (self.low + (np.tanh(said) + 1) * self.half).astype(np.float32)

    def evaluate(self, env, episodes: int, *, seed: int) -> list[float]:
        """Of the network itself, in every environment of it."""
        for net in self.nets:
            net.load_all(self.levels)
        returns: list[float] = []
        while len(returns) < episodes:
            returns.extend(self._play(env, [seed + len(returns) + at for at in range(env.num_envs)], learn=False))
        return [float(one) for one in returns[:episodes]]


def train(name: str, algorithm: str, seed: int, asked, state: Path | None) -> dict:
    count = 32 if algorithm == "es" else asked.envs
    env = environment(name, count, asked.backend)
    began, before = time.time(), 0.0
    if algorithm == "es":
        policy = Evolution(asked.hidden, seed).learn(env, asked.steps, lambda one: print(one.epochs[-1], flush=True))
    else:
        # without memory the likeliest action walks in circles where there is a world
        unsaid = {"environment.rollouts": 5, "evaluation.deterministic": not name.startswith("craftax/")}
        policy = dalean.EDPolicy(asked.hidden, horizon=asked.horizon, rule=algorithm, seed=seed, overrides={**unsaid, **asked.keys})
        kept = state.read_bytes() if state and state.exists() else None
        before = json.loads(state.with_suffix(".json").read_text()) if kept else 0.0

        def each(one) -> None:
            print(one.epochs[-1], flush=True)
            if state:
                state.with_suffix(".json").write_text(json.dumps(before + time.time() - began))
                fresh = state.with_suffix(".new")
                fresh.write_bytes(one.checkpoint())
                fresh.replace(state)

        policy.learn(env, asked.steps, each=each, go_on=kept)
    seconds = before + time.time() - began
    returns = policy.evaluate(env, asked.episodes, seed=10_000 + seed)
    env.close()
    return {
        "env": name,
        "algorithm": algorithm,
        "seed": seed,
        "steps": policy.steps,
        "asked": asked.steps,
        "hidden": asked.hidden,
        "envs": count,
        "horizon": asked.horizon,
        "backend": asked.backend if name.startswith("brax/") else None,
        "keys": asked.keys,
        "return": statistics.mean(returns),
        "episodes": len(returns),
        "seconds": round(seconds, 1),
    }


def welch(a: tuple[float, float, int], b: tuple[float, float, int]) -> tuple[float, float] | None:
    """t and degrees of freedom of two means with unequal spreads; each is mean, standard deviation, count."""
    parts = [one[1] ** 2 / one[2] for one in (a, b)]
    if sum(parts) == 0 or min(a[2], b[2]) < 2:
        return None
    t = (a[0] - b[0]) / math.sqrt(sum(parts))
    return t, sum(parts) ** 2 / sum(part**2 / (one[2] - 1) for part, one in zip(parts, (a, b), strict=True))


def table(told: list[dict]) -> str:
    """Ours beside the paper's, a row an environment, an algorithm and a number of steps."""
    groups: dict[tuple, list[dict]] = {}
    for one in told:
        groups.setdefault((one["env"], one["backend"] or "", one["algorithm"], one["asked"]), []).append(one)
    lines = ["| environment | learns by | steps | seeds | return | seconds a run | paper | Welch's t (degrees of freedom) |", "|---|---|--:|--:|--:|--:|--:|--:|"]
    for (env, backend, algorithm, steps), runs in sorted(groups.items()):
        returns = [one["return"] for one in runs]
        spread = statistics.stdev(returns) if len(returns) > 1 else 0.0
        paper = PAPER.get(env, {}).get(algorithm)
        tested = welch((statistics.mean(returns), spread, len(returns)), (*paper, PAPER_SEEDS)) if paper and paper[1] else None
        said = "not given" if paper is None else f"{paper[0]}" + (f" +- {paper[1]}" if paper[1] else "")
        compared = f"{tested[0]:.2f} ({tested[1]:.1f})" if tested else "too few seeds" if paper else ""
        seconds = statistics.mean(one["seconds"] for one in runs)
        ours = f"{statistics.mean(returns):.1f}" + (f" +- {spread:.1f}" if len(runs) > 1 else "")
        lines.append(f"| {env} {backend} | {ALGORITHMS[algorithm]} | {steps:,} | {len(runs)} | {ours} | {seconds:.0f} | {said} | {compared} |")
    others = [f"{env}: {OTHERS[env]}." for env in sorted({one["env"] for one in told}) if env in OTHERS]
    return "\n".join([*lines, "", DIFFERS, *others])


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--env", nargs="+", default=["brax/halfcheetah"])
    ask.add_argument("--algorithms", nargs="+", choices=list(ALGORITHMS), default=["ed"])
    ask.add_argument("--seeds", type=int, nargs="+", default=[1])
    ask.add_argument("--steps", type=int, default=1_000_000)
    ask.add_argument("--envs", type=int, default=16)
    ask.add_argument("--horizon", type=int, default=128, help="steps of an environment in a rollout")
    ask.add_argument("--hidden", type=int, nargs="+", default=[64, 64])
    ask.add_argument("--episodes", type=int, default=20)
    ask.add_argument("--backend", default="spring", help="of Brax: spring, positional, generalized, mjx")
    ask.add_argument("--set", dest="pairs", action="append", default=[], metavar="KEY=VALUE", help="any key, the value as JSON")
    ask.add_argument("--out", type=Path, help="JSON lines, a run each")
    ask.add_argument("--table", action="store_true", help="nothing but the table of what there is")
    asked = ask.parse_args()
    asked.keys = {key: json.loads(value) for key, value in (one.split("=", 1) for one in asked.pairs)}
    told = [json.loads(line) for line in asked.out.read_text().splitlines()] if asked.out and asked.out.exists() else []
    same = ("env", "algorithm", "seed", "asked", "hidden", "backend", "horizon", "keys")
    done = {json.dumps([one[key] for key in same]) for one in told}
    for name in [] if asked.table else asked.env:
        for algorithm in asked.algorithms:
            for seed in asked.seeds:
                backend = asked.backend if name.startswith("brax/") else None
                which = json.dumps([name, algorithm, seed, asked.steps, asked.hidden, backend, asked.horizon, asked.keys])
                if which in done:
                    continue
                print(f"{name}, {ALGORITHMS[algorithm]}, seed {seed}", flush=True)
                words = f"{asked.out.name}.{name.replace('/', '-')}.{algorithm}.{seed}.{asked.steps}.state" if asked.out else ""
                state = asked.out.with_name(words) if asked.out else None
                one = train(name, algorithm, seed, asked, state)
                told.append(one)
                if asked.out:
                    with asked.out.open("a") as file:
                        print(json.dumps(one), file=file)
                    for ending in (".state", ".json"):
                        state.with_suffix(ending).unlink(missing_ok=True)
    print(table(told))


if __name__ == "__main__":
    main()
