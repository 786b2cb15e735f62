"""The parts of the planner: plausible people, beliefs about them, the capacity model and the look-ahead."""
