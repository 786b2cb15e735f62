"""What the planner is made of: plausible people, beliefs about them, and the look ahead."""
