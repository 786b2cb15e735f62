"""The monitor: it folds gaze, decisions and results into the partner model and publishes observations."""
