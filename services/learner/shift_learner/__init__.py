"""The learner: reward, update, and the policy as action probabilities for each state."""
