"""Live sources of gaze: Lab Streaming Layer, Pupil Labs."""
