"""A policy on one of Gymnasium's MuJoCo environments, whose every weight is a non-negative 8-bit cell.

    pip install "./python[mujoco]"
    python examples/python/locomotion.py HalfCheetah-v5 --steps 1_000_000 --seeds 1 2 3 --out cheetah.jsonl

Prints a line of JSON a seed: mean and spread of the returns of episodes that are played after the training with the likeliest
actions, steps, seconds, and the hash of the state. A seed whose line is in the file is not trained again.
"""

import argparse
import json
import os
import platform
import statistics
import time
from pathlib import Path

import gymnasium

import dalean

# chosen on other seeds than those that docs/results/policies.md reports
KEYS = {"environment.rollouts": 5}


def train(name: str, steps: int, seed: int, envs: int, hidden: list[int], keys: dict, episodes: int, report=None) -> dict:
    """Trains one policy and plays it."""
    policy = dalean.EDPolicy(hidden, seed=seed, overrides={**KEYS, **keys})
    env = gymnasium.make_vec(name, envs, vectorization_mode="sync")  # begins again in the next step
    began, worked = time.time(), time.process_time()
    policy.learn(env, steps, each=report)
    spent = {"seconds": time.time() - began, "seconds_of_processor": time.process_time() - worked}
    env.close()
    returns = policy.evaluate(name, episodes, envs=envs, seed=10_000 + seed)
    curve = [[one["steps"], one["return_mean"]] for one in policy.epochs]
    return {
        "environment": name,
        "seed": seed,
        "steps": policy.steps,
        "return_mean": statistics.mean(returns),
        "return_sd": statistics.stdev(returns),
        "episodes": len(returns),
        **{key: round(value, 1) for key, value in spent.items()},
        "hidden": hidden,
        "envs": envs,
        "keys": keys,
        "state_hash": policy.state_hash,
        "gymnasium": gymnasium.__version__,
        "machine": platform.machine(),
        "training": [one for one in curve if one[1] is not None],
    }


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("environment", nargs="?", default="HalfCheetah-v5")
    ask.add_argument("--steps", type=int, default=1_000_000)
    ask.add_argument("--seeds", type=int, nargs="+", default=[1])
    ask.add_argument("--envs", type=int, default=16)
    ask.add_argument("--hidden", type=int, nargs="+", default=[64, 64])
    ask.add_argument("--episodes", type=int, default=20)
    ask.add_argument("--set", dest="keys", action="append", default=[], metavar="KEY=VALUE", help="any key, the value as JSON")
    ask.add_argument("--out", type=Path)
    asked = ask.parse_args()
    keys = {key: json.loads(value) for key, value in (one.split("=", 1) for one in asked.keys)}
    told = [json.loads(line) for line in asked.out.read_text().splitlines()] if asked.out and asked.out.exists() else []
    which = (asked.environment, asked.hidden, asked.envs, keys)
    done = {one["seed"] for one in told if (one["environment"], one["hidden"], one["envs"], one["keys"]) == which and one["steps"] >= asked.steps}
    for seed in asked.seeds:
        if seed in done:
            continue
        report = lambda policy: print(f"seed {seed}: {policy.epochs[-1]}", flush=True)  # noqa: E731
        one = train(asked.environment, asked.steps, seed, asked.envs, asked.hidden, keys, asked.episodes, report)
        print(json.dumps({key: value for key, value in one.items() if key != "training"}), flush=True)
        if asked.out:
            with asked.out.open("a") as file:
                print(json.dumps(one), file=file)


if __name__ == "__main__":
    main()
