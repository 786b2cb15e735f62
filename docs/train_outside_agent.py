"""Train an agent from outside on a simulated partner: tabular SARSA through Gymnasium.

    pip install gymnasium
    python docs/train_outside_agent.py

Sutton & Barto 2018, section 6.4. It needs thousands of sessions where the planner has one; what it shows is that any
agent that speaks Gymnasium can be tried on these people.
"""

from __future__ import annotations

import gymnasium
import numpy as np

SESSIONS, LEARNING_RATE, DISCOUNT, EPSILON = 1000, 0.1, 0.9, 0.1


def main() -> None:
    """Print the mean reward of each tenth of the training. A state is the triple and the action before."""
    env = gymnasium.make("shift_simulator.env:shift/Partner-v0", user="B", observation="triples")
    rng = np.random.default_rng(0)
    actions = env.action_space.n
    values = np.zeros((env.observation_space.n, actions, actions))

    def choose(state: tuple[int, int], epsilon: float) -> int:
        return int(rng.integers(actions) if rng.random() < epsilon else values[state].argmax())

    totals = []
    for session in range(SESSIONS):
        epsilon = EPSILON * (1 - session / SESSIONS)
        triple, _ = env.reset(seed=session)
        state, total, over = (int(triple), 0), 0.0, False
        action = choose(state, epsilon)
        while not over:
            triple, reward, _, over, _ = env.step(action)
            following = int(triple), action
            then = choose(following, epsilon)
            target = reward + DISCOUNT * values[following][then]
            values[state][action] += LEARNING_RATE * (target - values[state][action])
            state, action, total = following, then, total + float(reward)
        totals.append(total)
    for part in np.array_split(np.array(totals), 10):
        print(f"{part.mean():6.2f}")


if __name__ == "__main__":
    main()
