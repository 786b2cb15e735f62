"""The paper's computational model as pure functions. It is the lowest layer and imports nothing of ours."""
