"""The paper's computational model as pure functions."""
