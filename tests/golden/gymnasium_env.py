"""Steps of classic environments as Gymnasium takes them, each from a recorded state.

    python3 tests/golden/gymnasium_env.py tests/golden/environments        (Gymnasium 1.4.0, NumPy 2)

Writes a file an environment: the library's version, the greatest number of steps, then a line a step with the state before,
the action, the state after, the reward and whether the task is over. A third of the states are met while playing, the
others lie where a rule changes: at the ends of positions and angles, at the limits of speeds, at the goal. States have 9
decimals (float32 where Gymnasium keeps float32), actions that are numbers are multiples of 2^-16. Nothing here is shared
with dalean. `tests/it/environments.rs` reads.
"""

import sys
from pathlib import Path

import gymnasium
import numpy as np

rng = np.random.default_rng(15)
PI = np.pi


def close(center, most=1e-2):
    """A number near another, often very near."""
    return center + rng.choice([-1, 1]) * most * 10 ** rng.uniform(-5, 0)


def number():
    """An action from -1 to 1, often an end or 0."""
    return float(rng.choice([-1.0, 0.0, 1.0])) if rng.random() < 0.2 else round(rng.uniform(-1, 1) * 65536) / 65536


def cart_pole():
    env = gymnasium.make("CartPole-v1").unwrapped
    states = []
    while len(states) < 100:
        env.reset(seed=len(states))
        for _ in range(200):
            states.append(np.array(env.state))
            _, _, over, _, _ = env.step(int(rng.integers(2)) if rng.random() < 0.5 else int(env.state[2] + env.state[3] / 4 > 0))
            if over:
                break
    states = [states[i] for i in rng.choice(len(states), 100, replace=False)]
    for at in range(200):
        x, v, a, w = rng.uniform(-2.4, 2.4), rng.normal() * 3, rng.uniform(-0.2, 0.2), rng.normal() * 3
        if at % 3 == 0:
            x = close(rng.choice([-2.4, 2.4])) - 0.02 * v
        elif at % 3 == 1:
            a = close(rng.choice([-1, 1]) * 12 * PI / 180, 1e-3) - 0.02 * w
        states.append([x, v, a, w])
    return env, states, lambda: int(rng.integers(2)), np.float64


def acrobot():
    env = gymnasium.make("Acrobot-v1").unwrapped
    met, at_line = [], []
    while len(met) < 4000:
        env.reset(seed=len(met))
        for _ in range(300):
            met.append(np.array(env.state, dtype=np.float64))
            _, _, over, _, _ = env.step(int(np.sign(env.state[3])) + 1 if rng.random() < 0.9 else int(rng.integers(3)))
            height = -np.cos(env.state[0]) - np.cos(env.state[0] + env.state[1])
            at_line.append(abs(height - 1))
            if over:
                break
    nearest = np.argsort(at_line)[:80]
    states = [met[i] for i in nearest] + [met[i] for i in rng.choice(len(met), 100, replace=False)]
    for at in range(120):
        v, w = rng.uniform(-4 * PI, 4 * PI), rng.uniform(-9 * PI, 9 * PI)
        share = [0.3, 0.6, 1][at % 3]
        states.append([rng.uniform(-PI, PI), rng.uniform(-PI, PI), v * share, w * share])
    return env, states, lambda: int(rng.integers(3)), np.float64


def pendulum():
    env = gymnasium.make("Pendulum-v1").unwrapped
    states = []
    for at in range(300):
        a, w = rng.uniform(-PI, PI), rng.uniform(-8, 8)
        if at % 3 == 1:
            w = np.clip(close(rng.choice([-8, 8]), 1.0), -8, 8)
        elif at % 3 == 2:
            a = close(rng.choice([-25, -3, -1, 1, 3, 7, 25]) * PI, 0.1)
        states.append([a, w])
    return env, states, number, np.float64


def mountain_car():
    env = gymnasium.make("MountainCarContinuous-v0").unwrapped
    states = []
    for at in range(300):
        x, v = rng.uniform(-1.2, 0.6), rng.uniform(-0.07, 0.07)
        if at % 5 == 1:
            v = np.clip(close(rng.choice([-0.07, 0.07]), 2e-3), -0.07, 0.07)
        elif at % 5 == 2:
            x = max(close(-1.2, 0.05), -1.2)
        elif at % 5 == 3:
            x = close(0.45, 1e-2) - v
        elif at % 5 == 4:
            x, v = close(0.45, 1e-2), close(0, 2e-3)
        states.append([min(max(x, -1.2), 0.6), v])
    return env, states, number, np.float32


FILES = {"cart_pole": cart_pole, "acrobot": acrobot, "pendulum": pendulum, "mountain_car": mountain_car}


def text(value):
    return format(float(value), ".9g") if isinstance(value, np.float32) else repr(round(float(value), 12))


def main(folder):
    for name, make in FILES.items():
        env, states, action_of, kind = make()
        lines = [f"gymnasium {gymnasium.__version__}", f"{env.spec.id} {gymnasium.spec(env.spec.id).max_episode_steps}"]
        for state in states:
            before = np.array([round(float(value), 9) for value in state]).astype(kind)
            action = action_of()
            env.reset(seed=0)
            env.state = before.copy()
            scale = 2.0 if name == "pendulum" else 1.0
            given = action if isinstance(action, int) else np.array([action * scale], dtype=np.float32)
            _, reward, over, _, _ = env.step(given)
            after = np.asarray(env.state)
            values = [text(v) for v in before] + [repr(action)] + [text(v) for v in after]
            lines.append(",".join(values + [text(reward), str(int(over))]))
        path = Path(folder) / f"{name}.csv"
        path.write_text("\n".join(lines) + "\n")
        rows = [line.split(",") for line in lines[2:]]
        print(name, len(rows), "steps,", sum(row[-1] == "1" for row in rows), "over,", path.stat().st_size, "bytes")


main(sys.argv[1])
