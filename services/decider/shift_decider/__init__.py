"""The decider: scores, the cognitive state, the draw from the policy's row, the explanation."""
