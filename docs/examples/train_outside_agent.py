"""Train an agent of your own on a simulated partner, through Gymnasium: tabular SARSA.

    pip install gymnasium
    python docs/examples/train_outside_agent.py

The rule is in Sutton & Barto 2018, section 6.4. SARSA needs about a thousand sessions for what the planner does in
one. The example shows that any agent that uses Gymnasium can be tried with these simulated people.
"""

from __future__ import annotations

import gymnasium
import numpy as np

SESSIONS, LEARNING_RATE, DISCOUNT, EPSILON = 1000, 0.1, 0.9, 0.1


def main() -> None:
    """Print the mean reward of each tenth of the training. A state is the triple and the previous action."""
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
