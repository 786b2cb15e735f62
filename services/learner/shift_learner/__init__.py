"""The learner: it computes rewards, learns from them, and publishes a policy: action probabilities for each state."""
